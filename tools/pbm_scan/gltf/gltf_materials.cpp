#include "pbm_scan/gltf/gltf_materials.h"

#include "pbm_format/model/point_values.h"
#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/conventions/reflectance.h"
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

// The emissive factor of a material that shows nothing else: black, without an image of colours. Null: of another one.
const Json *emission_of(const Json &material, const glm::vec4 &factor, bool has_image) {
    const Json *const emission = member(&material, "emissiveFactor");
    if (has_image || glm::vec3(factor) != glm::vec3(0) || items(emission) < 3)
        return nullptr;
    return glm::vec3(factor_of(emission)) != glm::vec3(0) ? emission : nullptr;
}

} // namespace

GltfMaterials::GltfMaterials(GltfDocument &document, const ReadOptions &options, Surface &surface,
                             std::vector<AttributeReport> &report)
    : document_(document), options_(options), surface_(surface), images_(surface, report), report_(report) {
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

std::uint16_t GltfMaterials::load_image(std::size_t image, const TextureUse &use, const std::string &variant) {
    const Json *const described = item(document_.root("images"), image);
    const std::string uri = text_of(described, "uri"), given = text_of(described, "name");
    const std::string name = !uri.empty() && !uri.starts_with("data:") ? uri
                             : given.empty()                           ? "images[" + std::to_string(image) + "]"
                                                                       : given;
    const auto drop = [&](const std::string &why) {
        drop_once(report_, "texture image " + printable_in_quotes(name), why, Warning::missing_image);
        return Surface::kNoTexture;
    };
    // The number makes the name unique.
    const std::string key = variant + std::to_string(image) + "/" + name;
    if (const auto of_view = index_of(described, "bufferView")) {
        const auto view = document_.view(*of_view);
        return view ? images_.of_bytes(key, view->bytes, use) : drop(view.error().message);
    }
    if (uri.empty())
        return drop("it has neither bytes nor a file");
    const auto resource = document_.resource(uri);
    return resource ? images_.of_bytes(key, resource->bytes(), use) : drop(resource.error().message);
}

bool GltfMaterials::read_image(const Json &used, TextureUse use, GltfImage &image, const std::string &variant) {
    const Json *const texture = item(document_.root("textures"), index_of(&used, "index").value_or(~std::size_t{0}));
    if (texture == nullptr)
        return false;
    const Json *const extensions = member(texture, "extensions");
    const auto webp = index_of(member(extensions, "EXT_texture_webp"), "source");
    const auto source = webp ? webp : index_of(texture, "source");
    if (!source) {
        drop_once(report_, "image of a material",
                  member(extensions, "KHR_texture_basisu") != nullptr
                      ? "KTX2 is not read; export it with PNG, JPEG or WebP"
                      : "its texture names no image that is read here",
                  Warning::missing_image);
        return false;
    }
    const Json *const sampler =
        item(document_.root("samplers"), index_of(texture, "sampler").value_or(~std::size_t{0}));
    use.wrap = {wrap_of(sampler, "wrapS"), wrap_of(sampler, "wrapT")};
    image.texture = load_image(*source, use, variant);
    const Json *const transform = member(member(&used, "extensions"), "KHR_texture_transform");
    image.transform = transform_of(transform);
    const auto set = index_of(transform, "texCoord");
    image.coordinates = "TEXCOORD_" + std::to_string(set ? *set : index_of(&used, "texCoord").value_or(0));
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

void GltfMaterials::read_normal_map(const Json &used, GltfMaterial &material) {
    constexpr double kMaxScale = 1000;
    const double scale = std::clamp(number_of(&used, "scale", 1), -kMaxScale, kMaxScale);
    GltfImage &image = material.layers[static_cast<std::size_t>(Layer::normals)];
    if (!read_image(used,
                    {.content = ImageContent::normals,
                     .relief = static_cast<float>(scale),
                     .is_green_down = options_.flip_green},
                    image))
        drop_once(report_, "normalTexture of materials", "it names no image that is read here", Warning::missing_image);
}

void GltfMaterials::read_reflectance_image(const Json *texture, const char *name, const TextureUse &use,
                                           GltfMaterial &material) {
    if (texture == nullptr)
        return;
    GltfImage &image = material.layers[static_cast<std::size_t>(Layer::reflectance)];
    const std::size_t before = surface_.textures.size();
    // Each image of colours darkens its own copy.
    const glm::vec3 factor(material.factor);
    const std::string variant = std::to_string(material.image.texture) + " " + std::to_string(factor.x) + " " +
                                std::to_string(factor.y) + " " + std::to_string(factor.z) + " ";
    if (!read_image(*texture, use, image, variant))
        drop_once(report_, std::string(name) + " of materials", "it names no image that is read here",
                  Warning::missing_image);
    if (surface_.textures.size() == before || use.content != ImageContent::roughness_metal)
        return;
    const bool is_on_same_places = material.image.texture != Surface::kNoTexture &&
                                   material.image.coordinates == image.coordinates &&
                                   material.image.transform == image.transform;
    darken_metal(surface_.textures.back(), is_on_same_places ? &surface_.textures[material.image.texture] : nullptr,
                 factor);
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
        const Reflectance factors{.roughness = share(glossy, "glossinessFactor", 1),
                                  .specular = strongest(member(glossy, "specularFactor"))};
        read_reflectance_image(image, "specularGlossinessTexture",
                               {.content = ImageContent::specular_gloss, .factors = factors}, material);
        // Without its image, the usual factor of gloss would make a mirror.
        if (image == nullptr || material.has_image_of(Layer::reflectance))
            material.reflectance = reflectance_of(factors.specular, factors.roughness);
    } else {
        const Json *const metallic = member(&described, "pbrMetallicRoughness");
        const Json *const specular = member(extensions, "KHR_materials_specular");
        const Reflectance factors{share(metallic, "roughnessFactor", 1), share(metallic, "metallicFactor", 1),
                                  share(specular, "specularFactor", 1) *
                                      strongest(member(specular, "specularColorFactor"))};
        material.reflectance = factors;
        read_reflectance_image(member(metallic, "metallicRoughnessTexture"), "metallicRoughnessTexture",
                               {.content = ImageContent::roughness_metal, .factors = factors}, material);
    }
    if (material.reflectance)
        set_reflectance(*material.reflectance, material.material);
}

std::uint16_t GltfMaterials::plain_image(const GltfMaterial &material) {
    return images_.of_texel({.is_tinted = true, .least_opacity = material.cutoff, .opacity = material.factor.w});
}

const GltfMaterial &GltfMaterials::get(std::optional<std::size_t> index) {
    const std::size_t number = index.value_or(~std::size_t{0});
    if (const auto found = known_.find(number); found != known_.end())
        return found->second;
    GltfMaterial &made = known_[number];
    made.material = options_.default_material;
    const Json *const described = item(document_.root("materials"), number);
    if (described == nullptr)
        return made;
    const Json *const extensions = member(described, "extensions");
    const Json *const glossy = member(extensions, "KHR_materials_pbrSpecularGlossiness");
    const Json *const metallic = member(described, "pbrMetallicRoughness");
    const Json *const image =
        glossy != nullptr ? member(glossy, "diffuseTexture") : member(metallic, "baseColorTexture");
    made.factor = factor_of(colour_factor(*described), static_cast<double>(white_));
    const Json *const emission = emission_of(*described, made.factor, image != nullptr);
    if (emission != nullptr) {
        const double strength = std::clamp(
            number_of(member(extensions, "KHR_materials_emissive_strength"), "emissiveStrength", 1), 0.0, 1e6);
        const glm::vec3 light = static_cast<float>(strength) * glm::vec3(factor_of(emission));
        made.factor = glm::vec4(glm::min(light, glm::vec3(1)), made.factor.w);
        report_once(report_, {kEmission, Fate::converted, "the colours of materials whose own are black"});
    }
    for (std::size_t i = 0; i < 3; ++i)
        made.material.colour[i] = to_srgb(made.factor[static_cast<int>(i)]);
    if (emission != nullptr) {
        made.material.ka = 1;
        made.material.kd = made.material.ks = 0;
    } else if (member(extensions, "KHR_materials_unlit") != nullptr) {
        made.material.ka = 1;
        made.material.kd = made.material.ks = 0;
        if (!std::exchange(has_unlit_, true))
            report_.push_back({"unlit materials", Fate::kept, "ambient reflection alone"});
    }
    const std::string mode = text_of(described, "alphaMode");
    if (mode == "MASK")
        made.cutoff =
            static_cast<float>(std::clamp<double>(number_of(described, "alphaCutoff", kUsualAlphaCutoff), 0, 2));
    made.is_cut = mode == "BLEND" || made.cutoff > 0;
    const Json *const emissive = emission != nullptr ? member(described, "emissiveTexture") : nullptr;
    if (image != nullptr || emissive != nullptr)
        read_colour_image(image != nullptr ? *image : *emissive, made);
    const bool is_lit = emission == nullptr && member(extensions, "KHR_materials_unlit") == nullptr;
    if (is_lit)
        read_reflectance(*described, made);
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
    drop(described, "occlusionTexture", "the ambient light of a model is the same everywhere");
    if (emission == nullptr) {
        drop(described, "emissiveTexture", "materials with colours of their own emit no light");
        const Json *const light = member(described, "emissiveFactor");
        if (items(light) >= 3 && glm::vec3(factor_of(light)) != glm::vec3(0))
            drop(described, "emissiveFactor", "materials with colours of their own emit no light");
    }
    if (!is_lit) {
        drop(metallic, "metallicRoughnessTexture", "unlit materials reflect nothing");
        drop(glossy, "specularGlossinessTexture", "unlit materials reflect nothing");
    }
    const Json *const specular = member(extensions, "KHR_materials_specular");
    drop(specular, "specularTexture", "the factor counts");
    drop(specular, "specularColorTexture", "the factor counts");
    return made;
}

} // namespace pbm::build
