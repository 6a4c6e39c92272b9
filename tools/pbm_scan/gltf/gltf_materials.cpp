#include "pbm_scan/gltf/gltf_materials.h"

#include "pbm_format/model/point_values.h"
#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/conventions/reflectance.h"
#include "pbm_scan/images/read_image.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/text_number.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace pbm::build {
namespace {

Wrap wrap_of(const Json *sampler, const char *key) {
    constexpr std::size_t kClamp = 33071, kMirror = 33648;
    const std::size_t mode = index_of(sampler, key).value_or(0);
    return mode == kClamp ? Wrap::clamp : mode == kMirror ? Wrap::mirror : Wrap::repeat;
}

std::uint8_t to_srgb(float linear) {
    constexpr float kWhite = 65535;
    return linear_to_srgb(static_cast<std::uint32_t>(std::clamp(linear, 0.0F, 1.0F) * kWhite + 0.5F));
}

// `white`: of its colour.
glm::vec4 factor_of(const Json *values, double white = 1) {
    glm::vec4 factor(1);
    for (std::size_t i = 0; i < 4; ++i) {
        const double number = number_of(item(values, i), i < 3 ? white : 1);
        factor[static_cast<int>(i)] = static_cast<float>(std::clamp(i < 3 ? number / white : number, 0.0, 1.0));
    }
    return factor;
}

// The factor of a material's colour, or null.
const Json *colour_factor(const Json &material) {
    const Json *const glossy = member(member(&material, "extensions"), "KHR_materials_pbrSpecularGlossiness");
    return glossy != nullptr ? member(glossy, "diffuseFactor")
                             : member(member(&material, "pbrMetallicRoughness"), "baseColorFactor");
}

TextureUse use_in(const GltfImage &image, TextureUse use) {
    use.wrap = image.wrap;
    return use;
}

// KHR_texture_transform: scaled, turned, moved.
glm::mat3 transform_of(const Json *extension) {
    const Json *const offset = member(extension, "offset"), *const scale = member(extension, "scale");
    const double turn = number_of(extension, "rotation", 0), c = std::cos(turn), s = std::sin(turn);
    const double x = number_of(item(scale, 0), 1), y = number_of(item(scale, 1), 1);
    glm::mat3 matrix(1);
    matrix[0] = {c * x, -s * x, 0};
    matrix[1] = {s * y, c * y, 0};
    matrix[2] = {number_of(item(offset, 0), 0), number_of(item(offset, 1), 0), 1};
    return matrix;
}

constexpr const char *kEmission = "emission of materials";

glm::vec3 emissive_factor(const Json &material) {
    const Json *const factor = member(&material, "emissiveFactor");
    return items(factor) < 3 ? glm::vec3(0) : glm::vec3(factor_of(factor));
}

// Linear; the image of emission multiplies it.
glm::vec3 emitted_light(const Json &material) {
    constexpr double kMaxStrength = 1e6;
    const Json *const extension = member(member(&material, "extensions"), "KHR_materials_emissive_strength");
    const double strength = std::clamp(number_of(extension, "emissiveStrength", 1), 0.0, kMaxStrength);
    return static_cast<float>(strength) * emissive_factor(material);
}

} // namespace

GltfMaterials::GltfMaterials(GltfDocument &document, const ReadOptions &options, Surface &surface,
                             std::vector<AttributeReport> &report)
    : document_(document), options_(options), images_(surface, report), report_(report) {
    const Json *const materials = document_.root("materials");
    ColourCounts counts;
    for (std::size_t i = 0; i < items(materials); ++i)
        if (const Json *const factor = colour_factor(*item(materials, i)); items(factor) >= 3)
            counts.add(
                glm::vec3(number_of(item(factor, 0), 1), number_of(item(factor, 1), 1), number_of(item(factor, 2), 1)));
    const ColourRange range = counts.range(ColourNumbers::any);
    if (range.white > 1) {
        white_ = range.white;
        report_.push_back({"factors of colours", Fate::converted,
                           "in 0.." + number_text(static_cast<double>(white_)) + ", not in 0..1 as glTF has them"});
    }
}

// The number makes it unique.
std::string GltfMaterials::name_of(std::size_t image) const {
    const Json *const described = item(document_.root("images"), image);
    const std::string uri = text_of(described, "uri"), given = text_of(described, "name"),
                      number = std::to_string(image);
    return number + "/" +
           (!uri.empty() && !uri.starts_with("data:") ? uri
            : given.empty()                           ? "images[" + number + "]"
                                                      : given);
}

Result<ByteView> GltfMaterials::bytes_of(std::size_t image, GltfResource &resource) {
    const Json *const described = item(document_.root("images"), image);
    if (const auto of_view = index_of(described, "bufferView")) {
        const auto view = document_.view(*of_view);
        return view ? Result<ByteView>(view->bytes) : view.error();
    }
    const std::string uri = text_of(described, "uri");
    if (uri.empty())
        return bad_input("it has neither bytes nor a file");
    auto opened = document_.resource(uri);
    if (!opened)
        return opened.error();
    resource = std::move(*opened);
    return resource.bytes();
}

std::uint16_t GltfMaterials::load_image(std::size_t image, const TextureUse &use) {
    const std::string name = name_of(image);
    GltfResource resource;
    const auto bytes = bytes_of(image, resource);
    if (bytes)
        return images_.of_bytes(name, *bytes, use);
    drop_once(report_, "texture image " + printable_in_quotes(name.substr(name.find('/') + 1)), bytes.error().message,
              Warning::missing_image);
    return Surface::kNoTexture;
}

std::optional<std::size_t> GltfMaterials::find_image(const Json &used, GltfImage &image) {
    const Json *const texture = item(document_.root("textures"), index_of(&used, "index").value_or(~std::size_t{0}));
    if (texture == nullptr)
        return std::nullopt;
    const Json *const extensions = member(texture, "extensions");
    const auto webp = index_of(member(extensions, "EXT_texture_webp"), "source");
    const auto source = webp ? webp : index_of(texture, "source");
    if (!source) {
        drop_once(report_, "image of a material",
                  member(extensions, "KHR_texture_basisu") != nullptr
                      ? "KTX2 is not read; export it with PNG, JPEG or WebP"
                      : "its texture names no image that is read here",
                  Warning::missing_image);
        return std::nullopt;
    }
    const Json *const sampler =
        item(document_.root("samplers"), index_of(texture, "sampler").value_or(~std::size_t{0}));
    image.wrap = {wrap_of(sampler, "wrapS"), wrap_of(sampler, "wrapT")};
    const Json *const transform = member(member(&used, "extensions"), "KHR_texture_transform");
    image.transform = transform_of(transform);
    const auto set = index_of(transform, "texCoord");
    image.coordinates = "TEXCOORD_" + std::to_string(set ? *set : index_of(&used, "texCoord").value_or(0));
    return source;
}

bool GltfMaterials::read_image(const Json &used, const TextureUse &use, GltfImage &image) {
    const auto source = find_image(used, image);
    if (!source)
        return false;
    image.texture = load_image(*source, use_in(image, use));
    return true;
}

void GltfMaterials::read_colour_image(const Json &used, GltfMaterial &material) {
    TextureUse use{.is_tinted = true};
    if (material.is_cut) {
        use.is_blended = material.cutoff == 0;
        use.least_opacity = use.is_blended ? kUsualAlphaCutoff : material.cutoff;
        use.opacity = material.factor.w;
    }
    material.has_image = read_image(used, use, material.image);
}

void GltfMaterials::read_layer(Layer layer, const Json *texture, const char *name, const TextureUse &use,
                               GltfMaterial &material) {
    if (texture != nullptr && !read_image(*texture, use, material.layers[static_cast<std::size_t>(layer)]))
        drop_once(report_, std::string(name) + " of materials", "it names no image that is read here",
                  Warning::missing_image);
}

void GltfMaterials::read_normal_map(const Json &used, GltfMaterial &material) {
    constexpr double kMaxScale = 1000;
    const double scale = std::clamp(number_of(&used, "scale", 1), -kMaxScale, kMaxScale);
    read_layer(
        Layer::normals, &used, "normalTexture",
        {.content = ImageContent::normals, .relief = static_cast<float>(scale), .is_green_down = options_.flip_green},
        material);
}

// Adds an image to those that say how a material reflects, which become one and lie at `place`.
void GltfMaterials::add_reflectance_image(const Json &used, const char *name, ReflectancePart part, GltfImage &place,
                                          std::vector<ReflectanceImage> &images) {
    GltfImage image;
    const auto source = find_image(used, image);
    if (!source)
        return drop_once(report_, std::string(name) + " of materials", "it names no image that is read here",
                         Warning::missing_image);
    if (!images.empty() && !image.lies_as(place))
        return drop_once(report_, std::string(name) + " of materials",
                         "it does not lie as the other images of how they reflect; its factor counts");
    place = image;
    images.push_back(
        {.name = name_of(*source), .part = part, .read = [this, part, image = *source]() -> Result<Texture> {
             GltfResource resource;
             const auto bytes = bytes_of(image, resource);
             return bytes ? build::read_image(*bytes, part == ReflectancePart::specular_colour) : bytes.error();
         }});
}

// `factors`: of all images. Specular is a product of two factors and two images.
void GltfMaterials::read_reflectance_images(const Json *roughness_metal, const Json *specular,
                                            const Reflectance &factors, GltfMaterial &material) {
    const TextureUse use{.content = ImageContent::roughness_metal, .factors = factors};
    const Json *const of_factor = member(specular, "specularTexture");
    const Json *const of_colour = member(specular, "specularColorTexture");
    if (of_factor == nullptr && of_colour == nullptr)
        return read_layer(Layer::reflectance, roughness_metal, "metallicRoughnessTexture", use, material);
    GltfImage &place = material.layers[static_cast<std::size_t>(Layer::reflectance)];
    std::vector<ReflectanceImage> images;
    if (roughness_metal != nullptr)
        add_reflectance_image(*roughness_metal, "metallicRoughnessTexture", ReflectancePart::roughness_metal, place,
                              images);
    if (of_factor != nullptr)
        add_reflectance_image(*of_factor, "specularTexture", ReflectancePart::specular, place, images);
    const std::size_t before = images.size();
    if (of_colour != nullptr)
        add_reflectance_image(*of_colour, "specularColorTexture", ReflectancePart::specular_colour, place, images);
    if (images.size() > before) {
        // `factors` has the strongest channel.
        const glm::vec4 colour = factor_of(member(specular, "specularColorFactor"));
        const float strongest = std::max({colour.x, colour.y, colour.z});
        for (int c = 0; c < 3 && strongest > 0; ++c)
            images.back().colour[static_cast<std::size_t>(c)] = colour[c] / strongest;
    }
    place.texture = images_.of_reflectance(images, use_in(place, use));
}

void GltfMaterials::read_reflectance(const Json &described, GltfMaterial &material) {
    const auto share = [](const Json *of, const char *key, double usual) {
        return std::clamp(number_of(of, key, usual), 0.0, 1.0);
    };
    // The strongest channel of a colour.
    const auto strongest = [](const Json *colour) {
        const glm::vec4 factor = factor_of(colour);
        return static_cast<double>(std::max({factor.x, factor.y, factor.z}));
    };
    const Json *const extensions = member(&described, "extensions");
    if (const Json *const glossy = member(extensions, "KHR_materials_pbrSpecularGlossiness")) {
        const Json *const image = member(glossy, "specularGlossinessTexture");
        // The diffuse colour of such a metal is black.
        const Reflectance factors{.roughness = share(glossy, "glossinessFactor", 1),
                                  .specular = strongest(member(glossy, "specularFactor")),
                                  .tints = false};
        read_layer(Layer::reflectance, image, "specularGlossinessTexture",
                   {.content = ImageContent::specular_gloss, .factors = factors}, material);
        // Without its image, the usual factor of gloss would make a mirror.
        if (image == nullptr || material.has_image_of(Layer::reflectance)) {
            material.reflectance = reflectance_of(factors.specular, factors.roughness);
            material.reflectance->tints = material.reflectance->metal == 0;
        }
    } else {
        const Json *const metallic = member(&described, "pbrMetallicRoughness");
        const Json *const specular = member(extensions, "KHR_materials_specular");
        const Reflectance factors{share(metallic, "roughnessFactor", 1), share(metallic, "metallicFactor", 1),
                                  share(specular, "specularFactor", 1) *
                                      strongest(member(specular, "specularColorFactor"))};
        material.reflectance = factors;
        read_reflectance_images(member(metallic, "metallicRoughnessTexture"), specular, factors, material);
    }
    if (material.reflectance)
        set_reflectance(*material.reflectance, material.material);
}

// Light that is added to the colour.
void GltfMaterials::read_emission(const Json &described, GltfMaterial &material) {
    const Json *const texture = member(&described, "emissiveTexture");
    const glm::vec3 light = emitted_light(described);
    if (light == glm::vec3(0)) {
        if (texture != nullptr)
            drop_once(report_, "emissiveTexture of materials", "their emissiveFactor is black");
        return;
    }
    const TextureUse use{.content = ImageContent::emission, .light = {light.x, light.y, light.z}};
    GltfImage &image = material.layers[static_cast<std::size_t>(Layer::emission)];
    if (texture != nullptr)
        read_layer(Layer::emission, texture, "emissiveTexture", use, material);
    else
        image = {.texture = images_.of_texel(use), .is_uniform = true};
    if (image.texture != Surface::kNoTexture)
        report_once(report_, {"emission beside a colour", Fate::converted,
                              "added to the colours of points, which keep "
                              "that share of them without light"});
}

// Less ambient light.
void GltfMaterials::read_occlusion(const Json &described, GltfMaterial &material) {
    const Json *const texture = member(&described, "occlusionTexture");
    const auto strength = static_cast<float>(std::clamp(number_of(texture, "strength", 1), 0.0, 1.0));
    read_layer(Layer::occlusion, texture, "occlusionTexture",
               {.content = ImageContent::occlusion, .strength = strength}, material);
}

// Where there is emission or occlusion, an image of reflectance is expected too.
void GltfMaterials::complete_reflectance(GltfMaterial &material) {
    const bool is_needed = material.has_image_of(Layer::emission) || material.has_image_of(Layer::occlusion);
    if (!is_needed)
        return;
    material.plain_reflectance =
        images_.of_texel({.content = ImageContent::roughness_metal, .factors = *material.reflectance});
    if (!material.has_image_of(Layer::reflectance))
        material.layers[static_cast<std::size_t>(Layer::reflectance)] = {.texture = material.plain_reflectance,
                                                                         .is_uniform = true};
}

std::uint16_t GltfMaterials::plain_image(const GltfMaterial &material) {
    return images_.of_texel({.is_tinted = true, .least_opacity = material.cutoff, .opacity = material.factor.w});
}

const GltfMaterial &GltfMaterials::get(std::optional<std::size_t> index) {
    if (const auto found = known_.find(index); found != known_.end())
        return found->second;
    GltfMaterial &made = known_[index];
    made.material = options_.default_material;
    const Json *const described = index ? item(document_.root("materials"), *index) : nullptr;
    if (described == nullptr && index)
        drop_once(report_, "materials that do not exist", "the usual one takes their place");
    if (described == nullptr)
        return made;
    const Json *const extensions = member(described, "extensions");
    const Json *const glossy = member(extensions, "KHR_materials_pbrSpecularGlossiness");
    const Json *const metallic = member(described, "pbrMetallicRoughness");
    const Json *const image =
        glossy != nullptr ? member(glossy, "diffuseTexture") : member(metallic, "baseColorTexture");
    made.factor = factor_of(colour_factor(*described), static_cast<double>(white_));
    const bool is_unlit = member(extensions, "KHR_materials_unlit") != nullptr;
    const bool emits = emissive_factor(*described) != glm::vec3(0);
    // Black, so that all that it shows is its light.
    const bool is_lamp = image == nullptr && glm::vec3(made.factor) == glm::vec3(0) && emits;
    if (is_lamp) {
        made.factor = glm::vec4(glm::min(emitted_light(*described), glm::vec3(1)), made.factor.w);
        report_once(report_, {kEmission, Fate::converted, "the colours of materials whose own are black"});
    }
    for (std::size_t i = 0; i < 3; ++i)
        made.material.colour[i] = to_srgb(made.factor[static_cast<int>(i)]);
    if (is_lamp || is_unlit) {
        made.material.ka = 1;
        made.material.kd = made.material.ks = 0;
    }
    if (!is_lamp && is_unlit && !std::exchange(has_unlit_, true))
        report_.push_back({"unlit materials", Fate::kept, "ambient reflection alone"});
    const std::string mode = text_of(described, "alphaMode");
    if (mode == "MASK")
        made.cutoff =
            static_cast<float>(std::clamp<double>(number_of(described, "alphaCutoff", kUsualAlphaCutoff), 0, 2));
    made.is_cut = mode == "BLEND" || made.cutoff > 0;
    const Json *const emissive = is_lamp ? member(described, "emissiveTexture") : nullptr;
    if (image != nullptr || emissive != nullptr)
        read_colour_image(image != nullptr ? *image : *emissive, made);
    if (!is_lamp && !is_unlit)
        read_reflectance(*described, made);
    if (made.reflectance) {
        read_emission(*described, made);
        read_occlusion(*described, made);
        complete_reflectance(made);
    }
    if (const Json *const normals = member(described, "normalTexture"))
        read_normal_map(*normals, made);
    if (mode == "BLEND" && !made.has_image)
        drop_once(report_, "opacity of materials (" + mode + ")", "points are opaque");
    if (is_true(member(described, "doubleSided")) && !std::exchange(has_double_sided_, true))
        report_.push_back({"doubleSided materials", Fate::kept, "as all open surfaces, they are seen from both sides"});
    const auto drop = [&](const Json *from, const char *key, const char *why) {
        if (member(from, key) != nullptr)
            drop_once(report_, std::string(key) + " of materials", why);
    };
    if (is_lamp || is_unlit) {
        drop(metallic, "metallicRoughnessTexture", "unlit materials reflect nothing");
        drop(glossy, "specularGlossinessTexture", "unlit materials reflect nothing");
    }
    if (is_lamp || is_unlit || glossy != nullptr)
        for (const char *const key : {"specularTexture", "specularColorTexture"})
            drop(member(extensions, "KHR_materials_specular"), key,
                 glossy != nullptr ? "KHR_materials_pbrSpecularGlossiness says the same"
                                   : "unlit materials reflect nothing");
    if (!made.reflectance) {
        const char *const why = is_lamp || is_unlit ? "unlit materials have the same colour in any light"
                                                    : "how these materials reflect light cannot be read";
        drop(described, "occlusionTexture", why);
        if (!is_lamp)
            drop(described, "emissiveTexture", why);
        if (!is_lamp && emits)
            drop(described, "emissiveFactor", why);
    }
    return made;
}

} // namespace pbm::build
