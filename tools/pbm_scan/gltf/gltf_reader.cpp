#include "pbm_scan/gltf/gltf_reader.h"

#include "pbm_format/model/point_values.h"
#include "pbm_scan/gltf/gltf_document.h"
#include "pbm_scan/gltf/gltf_materials.h"
#include "pbm_scan/gltf/gltf_primitives.h"
#include "pbm_scan/gltf/gltf_scene.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/text_number.h"

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <unordered_set>

namespace pbm::build {
namespace {

constexpr std::array<std::string_view, 15> kExtensions{"KHR_texture_transform",
                                                       "KHR_mesh_quantization",
                                                       "KHR_materials_unlit",
                                                       "KHR_draco_mesh_compression",
                                                       "EXT_meshopt_compression",
                                                       "KHR_meshopt_compression",
                                                       "EXT_texture_webp",
                                                       "KHR_materials_pbrSpecularGlossiness",
                                                       "KHR_texture_basisu", // the image is dropped, and said
                                                       "KHR_node_visibility",
                                                       "EXT_mesh_gpu_instancing",
                                                       "CESIUM_RTC",
                                                       "KHR_gaussian_splatting",
                                                       "KHR_materials_specular",
                                                       "KHR_materials_emissive_strength"};

// A matrix, and what it makes of normals.
struct Placing {
    glm::dmat4 to_scene;
    double determinant;
    glm::dmat3 of_normals;

    explicit Placing(const glm::dmat4 &matrix)
        : to_scene(matrix), determinant(glm::determinant(glm::dmat3(matrix))),
          of_normals(determinant != 0 ? glm::transpose(glm::inverse(glm::dmat3(matrix))) : glm::dmat3(matrix)) {}
};

// What a document holds besides what the specification describes.
struct Additions {
    std::set<std::string> extensions; // names, announced or not; at most kMaxExtensions
    bool has_extras = false;
};
constexpr std::size_t kMaxExtensions = 256;

Additions find_additions(const Json &root) {
    Additions found;
    const auto add = [&found](const std::string &name) {
        if (found.extensions.size() < kMaxExtensions)
            found.extensions.insert(name);
    };
    const Json *const announced = member(&root, "extensionsUsed");
    for (std::size_t i = 0; i < items(announced); ++i)
        add(text_of(item(announced, i)));
    std::vector<const Json *> left{&root};
    while (!left.empty()) {
        const Json &value = *left.back();
        left.pop_back();
        const Json *const extensions = member(&value, "extensions");
        for (const auto &[key, part] : value.items()) {
            found.has_extras = found.has_extras || (value.is_object() && key == "extras");
            if (part.is_structured() && !(value.is_object() && key == "extras"))
                left.push_back(&part);
        }
        if (extensions != nullptr && extensions->is_object())
            for (const auto &[name, extension] : extensions->items())
                add(name);
    }
    return found;
}

class GltfReader {
  public:
    GltfReader(GltfDocument &document, const ReadOptions &options)
        : document_(document), options_(options), report_(document.report()),
          materials_(document, options, surface_, report_), primitives_(document, materials_, options, report_) {}

    Result<Surface> run() {
        if (const Status known = check_extensions(); !known)
            return known.error();
        Result<GltfScene> scene = GltfScene::read(document_, report_);
        if (!scene)
            return scene.error();
        const std::vector<ShownMesh> &shown = scene->shown();
        std::uint64_t vertices = 0;
        for (const ShownMesh &mesh : shown) { // each is read once, and kept
            const auto read = primitives_.of_mesh(mesh);
            if (!read)
                return read.error();
            for (const GltfPrimitive &primitive : **read)
                vertices += primitive.vertices();
            if (vertices > primitives_.max_vertices())
                return too_large("instances of meshes with more than " + std::to_string(primitives_.max_vertices()) +
                                 " vertices in all; export fewer");
        }
        surface_.positions.reserve(vertices);
        colour_range_ = primitives_.colour_range();
        // Points go behind all triangles.
        for (const bool points : {false, true}) {
            const std::size_t before = surface_.positions.size();
            for (std::size_t i = 0; i < shown.size(); ++i) {
                if (const Status added = show(shown[i], points, *scene); !added)
                    return added.error();
                if (options_.progress)
                    options_.progress(
                        (static_cast<double>(i + 1) / static_cast<double>(shown.size()) + (points ? 1 : 0)) / 2);
            }
            if (points && !surface_.triangles.empty())
                surface_.points_beside_triangles = surface_.positions.size() - before;
        }
        surface_.views = views_of(document_, scene->cameras(), surface_.positions, report_);
        surface_.part_names = scene->names();
        if (!surface_.part_names.empty())
            report_.push_back(
                {"names of nodes", Fate::kept, counted(surface_.part_names.size(), "name") + " of the metadata"});
        return finish();
    }

  private:
    Status check_extensions() {
        const auto is_known = [](const std::string &name) {
            return std::find(kExtensions.begin(), kExtensions.end(), name) != kExtensions.end();
        };
        const Json *const required = document_.root("extensionsRequired");
        for (std::size_t i = 0; i < items(required); ++i)
            if (const std::string name = text_of(item(required, i)); !is_known(name))
                return unsupported("the glTF file requires " + printable_in_quotes(name) +
                                   ", which is not read; export it without, or as PLY");
        const Additions additions = find_additions(document_.root());
        std::vector<std::string> known;
        for (const std::string &name : additions.extensions)
            if (is_known(name))
                known.push_back(name);
            else
                drop_once(report_, "extension " + printable_in_quotes(name),
                          name == "KHR_lights_punctual" ? "lights of a scan are not used; --lights chooses them"
                                                        : "not known to PBM");
        if (!known.empty())
            report_.push_back({"extensions " + listed(known), Fate::kept, "known to PBM"});
        if (additions.has_extras)
            report_.push_back({"extras", Fate::kept, "not needed: data of other programs"});
        if (items(document_.root("animations")) != 0)
            drop_once(report_, "animations", "PBM's models stand still");
        return {};
    }

    Status show(const ShownMesh &shown, bool points, GltfScene &scene) {
        const Result<const std::vector<GltfPrimitive> *> primitives = primitives_.of_mesh(shown);
        if (!primitives)
            return primitives.error();
        const std::vector<glm::dmat4> *joints = nullptr;
        if (shown.skin) {
            const auto read = scene.joints(*shown.skin);
            if (!read)
                return read.error();
            joints = *read;
            has_skins_ = true;
        }
        for (const GltfPrimitive &primitive : **primitives)
            if (primitive.is_points == points)
                add(primitive, shown.to_scene, joints);
        return {};
    }

    // The matrix of a vertex that joints move.
    static glm::dmat4 blended(const GltfPrimitive &primitive, std::size_t vertex,
                              const std::vector<glm::dmat4> &joints) {
        const std::size_t count = 4 * primitive.joint_sets;
        glm::dmat4 sum(0);
        double weights = 0;
        for (std::size_t i = vertex * count; i < (vertex + 1) * count; ++i) {
            const auto weight = static_cast<double>(primitive.weights[i]),
                       joint = static_cast<double>(primitive.joints[i]);
            if (!(weight > 0) || !(joint >= 0 && joint < static_cast<double>(joints.size())))
                continue;
            sum += weight * joints[static_cast<std::size_t>(joint)];
            weights += weight;
        }
        return weights > 0 && std::isfinite(weights) ? sum / weights : joints.front();
    }

    void add(const GltfPrimitive &primitive, const glm::dmat4 &to_scene, const std::vector<glm::dmat4> *joints) {
        const std::size_t first = surface_.positions.size(), count = primitive.vertices();
        const bool is_skinned = joints != nullptr && primitive.joint_sets != 0 && !joints->empty();
        Placing placing(to_scene);
        if (!primitive.normals.empty())
            surface_.normals.resize(first, glm::vec3(0));
        const bool has_tangents = !primitive.tangents.empty() && !primitive.normals.empty();
        if (has_tangents)
            surface_.tangents.resize(first, glm::vec4(0));
        bool is_mirrored = placing.determinant < 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (is_skinned) {
                placing = Placing(blended(primitive, i, *joints));
                is_mirrored = i == 0 ? placing.determinant < 0 : is_mirrored;
            }
            const float *const p = &primitive.positions[3 * i];
            surface_.positions.emplace_back(glm::dvec3(placing.to_scene * glm::dvec4(p[0], p[1], p[2], 1)));
            if (primitive.normals.empty())
                continue;
            const float *const n = &primitive.normals[3 * i];
            const glm::dvec3 turned = placing.of_normals * glm::dvec3(n[0], n[1], n[2]);
            const double length = glm::length(turned);
            surface_.normals.emplace_back(length > 0 && std::isfinite(length) ? turned / length : glm::dvec3(0));
            if (has_tangents)
                surface_.tangents.push_back(turned_tangent(placing, &primitive.tangents[4 * i]));
        }
        has_normals_ = has_normals_ || (!primitive.normals.empty() && !primitive.are_splats);
        add_discs(primitive, first, std::cbrt(std::abs(placing.determinant)));
        add_colours(primitive, first);
        add_triangles(primitive, first, is_mirrored);
    }

    // Zero if it has no direction.
    static glm::vec4 turned_tangent(const Placing &placing, const float *tangent) {
        const glm::dvec3 turned = glm::dmat3(placing.to_scene) * glm::dvec3(tangent[0], tangent[1], tangent[2]);
        const double length = glm::length(turned);
        if (!(length > 0 && std::isfinite(length)))
            return glm::vec4(0);
        const bool is_mirrored = (tangent[3] < 0) != (placing.determinant < 0);
        return {glm::vec3(turned / length), is_mirrored ? -1 : 1};
    }

    // Radii of Gaussian splats, which show both of their sides.
    void add_discs(const GltfPrimitive &primitive, std::size_t first, double scale) {
        if (!primitive.are_splats)
            return;
        surface_.radii.resize(first, 0.0F);
        surface_.two_sided.resize(first, 0);
        for (const float radius : primitive.radii)
            surface_.radii.push_back(static_cast<float>(scale * static_cast<double>(radius)));
        surface_.two_sided.resize(surface_.positions.size(), 1);
    }

    static bool is_faded(const GltfPrimitive &primitive) {
        for (std::size_t i = 3; i < primitive.colours.size(); i += 4)
            if (primitive.colours[i] < 1)
                return true;
        return false;
    }

    // Whether a material without an image cuts parts of the primitive away.
    static bool needs_plain_image(const GltfPrimitive &primitive) {
        const GltfMaterial &material = *primitive.material;
        return !primitive.is_points && primitive.places_in(material.image) == nullptr && material.cutoff > 0 &&
               (material.factor.w < material.cutoff || is_faded(primitive));
    }

    // Where an image lies on a triangle of the primitive, whose vertices lie at `places`; null: nowhere.
    static TextureCorners corners_in(const GltfImage &image, const std::vector<float> *places, const glm::uvec3 &t,
                                     bool is_mirrored) {
        TextureCorners corners{};
        for (int corner = 0; corner < 3 && places != nullptr; ++corner) {
            const std::size_t vertex = t[is_mirrored && corner != 0 ? 3 - corner : corner];
            const glm::vec3 place((*places)[2 * vertex], (*places)[2 * vertex + 1], 1);
            corners[static_cast<std::size_t>(corner)] = glm::vec2(image.transform * place);
        }
        return corners;
    }

    void add_triangles(const GltfPrimitive &primitive, std::size_t first, bool is_mirrored) {
        const GltfMaterial &material = *primitive.material;
        const bool is_plain = needs_plain_image(primitive);
        const std::uint16_t plain = is_plain ? materials_.plain_image(material) : Surface::kNoTexture;
        has_colours_ = has_colours_ || is_plain;
        const std::vector<float> *const in_colours = primitive.places_in(material.image);
        std::array<const std::vector<float> *, kLayers> in_layers{};
        std::array<std::uint16_t, kLayers> of_layers{};
        constexpr auto kOfReflectance = static_cast<std::size_t>(Layer::reflectance);
        for (std::size_t i = 0; i < kLayers; ++i) {
            const GltfImage &image = material.layers[i];
            in_layers[i] = image.is_uniform ? nullptr : primitive.places_in(image);
            of_layers[i] = in_layers[i] != nullptr || image.is_uniform ? image.texture : Surface::kNoTexture;
        }
        for (const Layer layer : {Layer::emission, Layer::occlusion}) {
            const auto i = static_cast<std::size_t>(layer);
            if (material.has_image_of(layer) && of_layers[i] == Surface::kNoTexture && !primitive.triangles.empty())
                drop_once(report_,
                          layer == Layer::emission ? "emissiveTexture of materials" : "occlusionTexture of materials",
                          "some faces have no texture coordinates for it");
            if (of_layers[i] != Surface::kNoTexture && of_layers[kOfReflectance] == Surface::kNoTexture)
                of_layers[kOfReflectance] = material.plain_reflectance; // its image has no place here
        }
        const bool has_places = in_colours != nullptr || std::any_of(in_layers.begin(), in_layers.end(),
                                                                     [](const auto *places) { return places; });
        has_places_ = has_places_ || (has_places && !primitive.triangles.empty());
        for (const glm::uvec3 &t : primitive.triangles) {
            const glm::uvec3 moved = t + static_cast<std::uint32_t>(first);
            const std::size_t triangle = surface_.triangles.size();
            surface_.triangles.push_back(is_mirrored ? glm::uvec3(moved.x, moved.z, moved.y) : moved);
            set_texture(surface_, triangle, in_colours != nullptr ? material.image.texture : plain,
                        corners_in(material.image, in_colours, t, is_mirrored));
            for (std::size_t i = 0; i < kLayers; ++i)
                set_texture(surface_, static_cast<Layer>(i), triangle, of_layers[i],
                            corners_in(material.layers[i], in_layers[i], t, is_mirrored));
        }
        surface_.has_facets = surface_.has_facets || (primitive.normals.empty() && !primitive.triangles.empty());
        surface_.dropped_triangles += primitive.degenerate;
    }

    void add_colours(const GltfPrimitive &primitive, std::size_t first) {
        const GltfMaterial &material = *primitive.material;
        const auto found = std::find(surface_.materials.begin(), surface_.materials.end(), material.material);
        const auto number = static_cast<std::size_t>(found - surface_.materials.begin());
        if (found == surface_.materials.end())
            surface_.materials.push_back(material.material);
        surface_.reflectances.resize(surface_.materials.size(), material.reflectance);
        materials_of_.resize(surface_.positions.size(), static_cast<std::uint32_t>(number));
        has_colours_ = has_colours_ || !primitive.colours.empty() || material.image.texture != Surface::kNoTexture;
        constexpr float kWhite = 65535;
        const bool has_own = !primitive.colours.empty() && colour_range_.white > 0;
        for (std::size_t i = first; i < surface_.positions.size(); ++i) {
            Rgb8 colour{};
            for (std::size_t c = 0; c < 3; ++c) {
                const float own = !has_own ? 1 : primitive.colours[4 * (i - first) + c] / colour_range_.white;
                const float linear = material.factor[static_cast<int>(c)] * own;
                colour[c] =
                    linear_to_srgb(static_cast<std::uint32_t>(linear > 0 ? std::min(linear, 1.0F) * kWhite + 0.5F : 0));
            }
            surface_.colours.push_back(colour);
        }
        if (material.is_cut && is_faded(primitive)) {
            surface_.transparencies.resize(first, 0);
            constexpr float kOpaque = 255;
            for (std::size_t i = 3; i < primitive.colours.size(); i += 4) {
                const float opacity = primitive.colours[i] > 0 ? std::min(primitive.colours[i], 1.0F) : 0;
                surface_.transparencies.push_back(
                    static_cast<std::uint8_t>(kOpaque - std::floor(opacity * kOpaque + 0.5F)));
            }
        }
        has_vertex_colours_ = has_vertex_colours_ || (!primitive.colours.empty() && !primitive.are_splats);
        // A material without image or factor has the default colour, not white.
        has_factor_ = has_factor_ || material.factor != glm::vec4(1);
    }

    Result<Surface> finish() {
        if (!surface_.normals.empty())
            surface_.normals.resize(surface_.positions.size(), glm::vec3(0));
        if (!surface_.tangents.empty()) {
            surface_.tangents.resize(surface_.positions.size(), glm::vec4(0));
            surface_.report.push_back({"TANGENT", Fate::kept, "as the directions of normal maps"});
        }
        if (!surface_.radii.empty()) {
            surface_.radii.resize(surface_.positions.size(), 0.0F);
            surface_.two_sided.resize(surface_.positions.size(), 0);
        }
        if (!surface_.transparencies.empty())
            surface_.transparencies.resize(surface_.positions.size(), 0);
        finish_materials();
        const auto kept = [&](const char *name, const char *note) {
            surface_.report.push_back({name, Fate::kept, note});
        };
        if (Status shown = primitives_.report_splats(surface_.positions.empty()); !shown)
            return shown.error();
        primitives_.finish_report();
        kept("POSITION", "positions, with the transforms of the nodes");
        if (has_skins_)
            kept("skins", "in the pose that the nodes of their joints have");
        else if (items(document_.root("skins")) != 0)
            surface_.report.push_back({"skins", Fate::dropped, "no node of the scene has one"});
        if (!surface_.triangles.empty() || surface_.dropped_triangles != 0)
            kept("primitives", "triangles");
        if (has_normals_)
            kept("NORMAL", "normals");
        if (has_vertex_colours_)
            report_colours();
        if (has_places_)
            report_textures(surface_);
        surface_.report.insert(surface_.report.end(), report_.begin(), report_.end());
        return finished(std::move(surface_), options_);
    }

    void report_colours() {
        constexpr const char *kName = "COLOR_0", *kNote = "sRGB, 8 bits, times the material's factor";
        const ColourRange &range = colour_range_;
        if (range.white == 0)
            surface_.report.push_back({kName, Fate::dropped, "nearly all are above 65,535: these are no colours"});
        else
            surface_.report.push_back({kName, Fate::converted,
                                       (range.white > 1 ? "in 0.." + number_text(static_cast<double>(range.white)) +
                                                              ", not in 0..1 as glTF has them; "
                                                        : "") +
                                           kNote + range.note()});
    }

    void finish_materials() {
        for (Texture &texture : surface_.textures)
            texture.use.is_tinted = has_vertex_colours_ || has_factor_;
        if (!has_colours_) {
            surface_.colours.clear();
            if (!has_factor_ && surface_.materials.size() == 1)
                surface_.materials.front().colour = options_.default_material.colour;
        }
        if (surface_.materials.size() > kMaxMaterials) {
            const std::string count = std::to_string(surface_.materials.size()) + " of them, a model has " +
                                      std::to_string(kMaxMaterials) + ": their colours are those of the points";
            if (!has_colours_)
                for (const std::uint32_t material : materials_of_)
                    surface_.colours.push_back(surface_.materials[material].colour);
            surface_.materials.clear();
            surface_.reflectances.clear();
            report_.push_back({"materials", Fate::converted, count});
            return;
        }
        if (surface_.materials.size() <= 1)
            return;
        for (const std::uint32_t material : materials_of_)
            surface_.material_ids.push_back(static_cast<std::uint8_t>(material));
    }

    GltfDocument &document_;
    const ReadOptions &options_;
    Surface surface_;
    std::vector<AttributeReport> report_;
    GltfMaterials materials_;
    GltfPrimitives primitives_;
    ColourRange colour_range_;
    std::vector<std::uint32_t> materials_of_; // [vertices]
    bool has_colours_ = false, has_vertex_colours_ = false, has_factor_ = false, has_normals_ = false,
         has_skins_ = false, has_places_ = false;
};

} // namespace

bool is_gltf(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kVersion = 4; // a text has letters there
    return as_text(bytes).starts_with("glTF") && (bytes.size() <= kVersion || bytes[kVersion] < ' ');
}

Result<Surface> read_gltf(const ScanFile &file, const ReadOptions &options) {
    Result<GltfDocument> document = GltfDocument::open(file);
    if (!document)
        return document.error();
    return GltfReader(*document, options).run();
}

std::vector<NamedFile> files_of_gltf(const ScanFile &file) {
    Result<GltfDocument> document = GltfDocument::open(file);
    std::vector<NamedFile> files;
    if (!document)
        return files;
    std::unordered_set<std::string> known;
    for (const char *kind : {"buffers", "images"}) {
        const Json *const all = document->root(kind);
        for (std::size_t i = 0; i < items(all); ++i)
            if (std::string uri = text_of(item(all, i), "uri"); !uri.empty() && known.insert(uri).second)
                if (auto named = file_of_uri(file.path, uri))
                    files.push_back(std::move(*named));
    }
    return files;
}

} // namespace pbm::build
