#include "pbm_scan/gltf/gltf_reader.h"

#include "pbm_format/model/point_values.h"
#include "pbm_scan/gltf/gltf_document.h"
#include "pbm_scan/gltf/gltf_draco.h"
#include "pbm_scan/gltf/gltf_materials.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <unordered_set>

namespace pbm::build {
namespace {

constexpr std::array<std::string_view, 10> kExtensions{"KHR_texture_transform",
                                                       "KHR_mesh_quantization",
                                                       "KHR_materials_unlit",
                                                       "KHR_draco_mesh_compression",
                                                       "EXT_meshopt_compression",
                                                       "KHR_meshopt_compression",
                                                       "EXT_texture_webp",
                                                       "KHR_materials_pbrSpecularGlossiness",
                                                       "KHR_texture_basisu", // the image is dropped, and said
                                                       "CESIUM_RTC"};

enum class Mode : std::uint8_t { points = 0, triangles = 4, strip = 5, fan = 6 };

// A part of a mesh in its own coordinates. Arrays are parallel to `positions`, or empty.
struct Primitive {
    std::vector<float> positions, normals, places, colours; // 3, 3, 2, 4 numbers each; colours linear
    std::vector<glm::uvec3> triangles;
    bool is_points = false, is_lines = false;
    const GltfMaterial *material = nullptr;
    std::size_t degenerate = 0;

    std::size_t vertices() const { return positions.size() / 3; }
};

glm::dmat4 matrix_of(const Json &node) {
    if (const Json *const given = member(&node, "matrix")) {
        glm::dmat4 matrix(1);
        for (std::size_t i = 0; i < 16; ++i) {
            const auto column = static_cast<int>(i / 4), row = static_cast<int>(i % 4);
            matrix[column][row] = number_of(item(given, i), column == row ? 1 : 0);
        }
        return matrix;
    }
    const Json *const moved = member(&node, "translation"), *const turned = member(&node, "rotation"),
                      *const scaled = member(&node, "scale");
    const glm::dquat rotation(number_of(item(turned, 3), 1), number_of(item(turned, 0), 0),
                              number_of(item(turned, 1), 0), number_of(item(turned, 2), 0));
    glm::dmat4 matrix = glm::mat4_cast(rotation);
    for (int axis = 0; axis < 3; ++axis) {
        matrix[axis] *= number_of(item(scaled, static_cast<std::size_t>(axis)), 1);
        matrix[3][axis] = number_of(item(moved, static_cast<std::size_t>(axis)), 0);
    }
    return matrix;
}

class GltfReader {
  public:
    GltfReader(GltfDocument &document, std::size_t file_size, const ReadOptions &options)
        : document_(document), options_(options),
          most_vertices_(std::min<std::uint64_t>(kMaxVertices, kFreeVertices + file_size)),
          materials_(document, options.default_material, surface_, report_) {}

    Result<Surface> run() {
        if (const Status known = check_extensions(); !known)
            return known.error();
        if (const Status collected = collect_nodes(); !collected)
            return collected.error();
        // Points go behind all triangles.
        for (const bool points : {false, true}) {
            const std::size_t before = surface_.positions.size();
            for (std::size_t i = 0; i < shown_.size(); ++i) {
                if (const Status shown = show(shown_[i], points); !shown)
                    return shown.error();
                if (options_.progress)
                    options_.progress(
                        (static_cast<double>(i + 1) / static_cast<double>(shown_.size()) + (points ? 1 : 0)) / 2);
            }
            if (points && !surface_.triangles.empty())
                surface_.points_beside_triangles = surface_.positions.size() - before;
        }
        return finish();
    }

  private:
    static constexpr std::uint64_t kFreeVertices = std::uint64_t{1} << 24;
    static constexpr std::size_t kMaxNodes = std::size_t{1} << 20;

    // A mesh at its place.
    struct Shown {
        std::size_t mesh;
        glm::dmat4 to_scene;
    };

    Status check_extensions() {
        const Json *const required = document_.root("extensionsRequired");
        for (std::size_t i = 0; i < items(required); ++i)
            if (const std::string name = text_of(item(required, i));
                std::find(kExtensions.begin(), kExtensions.end(), name) == kExtensions.end())
                return unsupported("the glTF file requires " + printable_in_quotes(name) +
                                   ", which is not read; export it without, or as PLY");
        for (const char *unused : {"animations", "skins", "cameras"})
            if (items(document_.root(unused)) != 0)
                drop_once(report_, unused, "PBM's models stand still");
        return {};
    }

    Status collect_nodes() {
        const Json *const nodes = document_.root("nodes");
        const std::size_t scene = index_of(document_.root("scene")).value_or(0);
        const Json *const roots = member(item(document_.root("scenes"), scene), "nodes");
        struct Visit {
            std::size_t node;
            glm::dmat4 to_scene;
            std::size_t depth;
        };
        glm::dmat4 origin(1); // CESIUM_RTC: the place of all coordinates
        if (const Json *const centre = member(member(document_.root("extensions"), "CESIUM_RTC"), "center"))
            for (std::size_t axis = 0; axis < 3; ++axis)
                origin[3][static_cast<int>(axis)] = number_of(item(centre, axis), 0);
        std::vector<Visit> left;
        const auto add = [&](const Json *list, std::size_t i, const glm::dmat4 &to_scene, std::size_t depth) {
            if (const auto node = index_of(item(list, i)))
                left.push_back({*node, to_scene, depth});
        };
        if (roots == nullptr && items(document_.root("scenes")) == 0) {
            for (std::size_t mesh = 0; mesh < items(document_.root("meshes")); ++mesh) // a library of meshes
                shown_.push_back({mesh, origin});
            return {};
        }
        for (std::size_t i = items(roots); i-- > 0;)
            add(roots, i, origin, 0);
        std::size_t visits = 0;
        while (!left.empty()) {
            const Visit visit = left.back();
            left.pop_back();
            const Json *const node = item(nodes, visit.node);
            if (node == nullptr)
                return bad_input("nodes[" + std::to_string(visit.node) + "] does not exist");
            if (visit.depth > items(nodes))
                return bad_input("nodes[" + std::to_string(visit.node) +
                                 "] is a child of itself; export the scan again");
            if (++visits > kMaxNodes)
                return too_large("more than " + std::to_string(kMaxNodes) + " nodes to show; export fewer");
            const glm::dmat4 to_scene = visit.to_scene * matrix_of(*node);
            if (const auto mesh = index_of(node, "mesh"))
                shown_.push_back({*mesh, to_scene});
            if (member(member(node, "extensions"), "EXT_mesh_gpu_instancing") != nullptr)
                drop_once(report_, "instances (EXT_mesh_gpu_instancing)", "the mesh is there once");
            const Json *const children = member(node, "children");
            for (std::size_t i = items(children); i-- > 0;)
                add(children, i, to_scene, visit.depth + 1);
        }
        return {};
    }

    Status show(const Shown &shown, bool points) {
        auto known = meshes_.find(shown.mesh);
        if (known == meshes_.end()) {
            Result<std::vector<Primitive>> read = read_mesh(shown.mesh);
            if (!read)
                return read.error();
            known = meshes_.emplace(shown.mesh, std::move(*read)).first;
        }
        for (const Primitive &primitive : known->second)
            if (primitive.is_points == points)
                if (Status added = add(primitive, shown.to_scene); !added)
                    return added;
        return {};
    }

    Result<std::vector<Primitive>> read_mesh(std::size_t index) {
        const Json *const mesh = item(document_.root("meshes"), index);
        const std::string name = "meshes[" + std::to_string(index) + "]";
        if (mesh == nullptr)
            return bad_input(name + " does not exist");
        const Json *const primitives = member(mesh, "primitives");
        std::vector<Primitive> out;
        for (std::size_t i = 0; i < items(primitives); ++i) {
            Primitive primitive;
            if (const Status read = read_primitive(*item(primitives, i), primitive); !read)
                return bad_input(name + ".primitives[" + std::to_string(i) + "]: " + read.error().message,
                                 read.error().offset);
            if (!primitive.positions.empty())
                out.push_back(std::move(primitive));
            else if (!primitive.is_lines)
                drop_once(report_, "primitives without POSITION", "there is nothing to show");
        }
        return out;
    }

    Status read_primitive(const Json &described, Primitive &out) {
        constexpr std::size_t kTriangles = 4;
        const std::size_t mode = index_of(&described, "mode").value_or(kTriangles);
        if (mode >= 1 && mode <= 3) {
            drop_once(report_, "lines", "PBM shows no lines");
            out.is_lines = true;
            return {};
        }
        if (mode > 6)
            return bad_input("mode " + std::to_string(mode) + " is none of glTF");
        out.is_points = mode == 0;
        out.material = &materials_.get(index_of(&described, "material"));
        const Json *const attributes = member(&described, "attributes");
        if (attributes == nullptr || !attributes->is_object())
            return {};
        if (items(member(&described, "targets")) != 0)
            drop_once(report_, "morph targets", "PBM's models stand still");
        const bool has_image = out.material->texture != Surface::kNoTexture;
        for (const auto &[name, accessor] : attributes->items()) {
            const bool used = name == "POSITION" || name == "NORMAL" || name == "COLOR_0" ||
                              (has_image && name == out.material->coordinates);
            if (!used && index_of(&accessor))
                drop_once(report_, printable(name),
                          name.starts_with("TEXCOORD") ? "no image of colours belongs to them" : "not used by PBM");
        }
        std::vector<std::uint32_t> corners;
        const Json *const draco = member(member(&described, "extensions"), "KHR_draco_mesh_compression");
        if (Status read = draco != nullptr ? read_compressed(*draco, *attributes, out, corners)
                                           : read_plain(described, *attributes, out, corners);
            !read)
            return read;
        const std::size_t count = out.vertices();
        if (out.positions.empty() || (!out.is_points && corners.empty()))
            return {};
        for (const auto &[values, width, name] : {std::tuple(&out.normals, 3, "NORMAL"),
                                                  {&out.places, 2, "texture coordinates"},
                                                  {&out.colours, 4, "COLOR_0"}})
            if (!values->empty() && values->size() != count * static_cast<std::size_t>(width))
                return bad_input(std::string(name) + " are not as many as POSITION");
        if (const auto beyond = std::find_if(corners.begin(), corners.end(), [&](auto c) { return c >= count; });
            beyond != corners.end())
            return bad_input("vertex index " + std::to_string(*beyond) + ", but there are " + std::to_string(count) +
                             " vertices");
        if (!out.is_points)
            add_triangles(static_cast<Mode>(mode), corners, out);
        return {};
    }

    Status read_plain(const Json &described, const Json &attributes, Primitive &out,
                      std::vector<std::uint32_t> &corners) {
        const auto read = [&](const char *name, std::size_t components, std::vector<float> &to) -> Status {
            const auto accessor = index_of(&attributes, name);
            if (!accessor)
                return {};
            auto values = document_.floats(*accessor, components);
            if (!values)
                return values.error();
            to = std::move(*values);
            return {};
        };
        for (Status status :
             {read("POSITION", 3, out.positions), read("NORMAL", 3, out.normals), read("COLOR_0", 4, out.colours),
              out.material->texture != Surface::kNoTexture ? read(out.material->coordinates.c_str(), 2, out.places)
                                                           : Status()})
            if (!status)
                return status;
        const auto accessor = index_of(&described, "indices");
        if (out.is_points && !accessor)
            return {};
        if (!accessor) {
            corners.resize(out.vertices());
            for (std::uint32_t i = 0; i < corners.size(); ++i)
                corners[i] = i;
            return {};
        }
        auto indices = document_.indices(*accessor);
        if (!indices)
            return indices.error();
        if (!out.is_points) // points are all vertices
            corners = std::move(*indices);
        return {};
    }

    Status read_compressed(const Json &draco, const Json &attributes, Primitive &out,
                           std::vector<std::uint32_t> &corners) {
        const auto view = document_.view(index_of(&draco, "bufferView").value_or(~std::size_t{0}));
        if (!view)
            return view.error();
        const Json *const ids = member(&draco, "attributes");
        std::vector<DracoRequest> requests;
        std::vector<std::vector<float> *> to;
        const auto want = [&](const std::string &name, std::uint32_t components, std::vector<float> &values) {
            const auto id = index_of(ids, name.c_str());
            const auto accessor = index_of(&attributes, name.c_str());
            if (!id || !accessor)
                return;
            requests.push_back({static_cast<std::uint32_t>(*id), components, document_.is_normalised(*accessor)});
            to.push_back(&values);
        };
        want("POSITION", 3, out.positions);
        want("NORMAL", 3, out.normals);
        want("COLOR_0", 4, out.colours);
        if (out.material->texture != Surface::kNoTexture)
            want(out.material->coordinates, 2, out.places);
        Result<DracoMesh> mesh = decode_draco(view->bytes, requests);
        if (!mesh)
            return mesh.error();
        for (std::size_t i = 0; i < to.size(); ++i)
            *to[i] = std::move(mesh->attributes[i]);
        corners = std::move(mesh->corners);
        return {};
    }

    static void add_triangles(Mode mode, const std::vector<std::uint32_t> &corners, Primitive &out) {
        const auto add = [&out](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            if (a != b && b != c && a != c)
                out.triangles.emplace_back(a, b, c);
            else
                ++out.degenerate;
        };
        if (mode == Mode::triangles) {
            out.triangles.reserve(corners.size() / 3);
            for (std::size_t i = 0; i + 3 <= corners.size(); i += 3)
                add(corners[i], corners[i + 1], corners[i + 2]);
            out.degenerate += corners.size() % 3 != 0 ? 1 : 0;
            return;
        }
        // Strips repeat corners to begin anew, so these are no lost triangles.
        const std::size_t degenerate = out.degenerate;
        for (std::size_t i = 2; i < corners.size(); ++i) {
            if (mode == Mode::fan)
                add(corners[0], corners[i - 1], corners[i]);
            else if (i % 2 == 0)
                add(corners[i - 2], corners[i - 1], corners[i]);
            else
                add(corners[i - 1], corners[i - 2], corners[i]);
        }
        out.degenerate = degenerate;
    }

    Status add(const Primitive &primitive, const glm::dmat4 &to_scene) {
        const std::size_t first = surface_.positions.size(), count = primitive.vertices();
        if (first + count > most_vertices_)
            return too_large("instances of meshes with more than " + std::to_string(most_vertices_) +
                             " vertices in all; export fewer");
        const glm::dmat3 turn(to_scene);
        const double determinant = glm::determinant(turn);
        const glm::dmat3 of_normals = determinant != 0 ? glm::transpose(glm::inverse(turn)) : turn;
        surface_.positions.reserve(first + count);
        for (std::size_t i = 0; i < count; ++i) {
            const float *const p = &primitive.positions[3 * i];
            surface_.positions.emplace_back(glm::dvec3(to_scene * glm::dvec4(p[0], p[1], p[2], 1)));
        }
        if (!primitive.normals.empty()) {
            surface_.normals.resize(first, glm::vec3(0));
            for (std::size_t i = 0; i < count; ++i) {
                const float *const n = &primitive.normals[3 * i];
                const glm::dvec3 turned = of_normals * glm::dvec3(n[0], n[1], n[2]);
                const double length = glm::length(turned);
                surface_.normals.emplace_back(length > 0 && std::isfinite(length) ? turned / length : glm::dvec3(0));
            }
        }
        add_colours(primitive, first);
        for (const glm::uvec3 &t : primitive.triangles) {
            const glm::uvec3 moved = t + static_cast<std::uint32_t>(first);
            surface_.triangles.push_back(determinant < 0 ? glm::uvec3(moved.x, moved.z, moved.y) : moved);
            TextureCorners corners{};
            const bool is_textured = !primitive.places.empty();
            for (int corner = 0; corner < 3 && is_textured; ++corner) {
                const std::size_t vertex = t[determinant < 0 && corner != 0 ? 3 - corner : corner];
                const glm::vec3 place(primitive.places[2 * vertex], primitive.places[2 * vertex + 1], 1);
                corners[static_cast<std::size_t>(corner)] = glm::vec2(primitive.material->transform * place);
            }
            set_texture(surface_, surface_.triangles.size() - 1,
                        is_textured ? primitive.material->texture : Surface::kNoTexture, corners);
        }
        surface_.dropped_triangles += primitive.degenerate;
        return {};
    }

    void add_colours(const Primitive &primitive, std::size_t first) {
        const GltfMaterial &material = *primitive.material;
        const auto found = std::find(surface_.materials.begin(), surface_.materials.end(), material.material);
        const auto number = static_cast<std::size_t>(found - surface_.materials.begin());
        if (found == surface_.materials.end())
            surface_.materials.push_back(material.material);
        materials_of_.resize(surface_.positions.size(), static_cast<std::uint16_t>(number));
        has_colours_ = has_colours_ || !primitive.colours.empty() || material.texture != Surface::kNoTexture;
        constexpr float kWhite = 65535;
        for (std::size_t i = first; i < surface_.positions.size(); ++i) {
            Rgb8 colour{};
            for (std::size_t c = 0; c < 3; ++c) {
                const float own = primitive.colours.empty() ? 1 : primitive.colours[4 * (i - first) + c];
                const float linear = material.factor[static_cast<int>(c)] * own;
                colour[c] =
                    linear_to_srgb(static_cast<std::uint32_t>(linear > 0 ? std::min(linear, 1.0F) * kWhite + 0.5F : 0));
            }
            surface_.colours.push_back(colour);
        }
        has_vertex_colours_ = has_vertex_colours_ || !primitive.colours.empty();
        // A material without image or factor has the default colour, not white.
        has_factor_ = has_factor_ || material.factor != glm::vec4(1);
    }

    Result<Surface> finish() {
        if (!surface_.normals.empty())
            surface_.normals.resize(surface_.positions.size(), glm::vec3(0));
        finish_materials();
        const auto kept = [&](const char *name, const char *note) {
            surface_.report.push_back({name, Fate::kept, note});
        };
        kept("POSITION", "positions, with the transforms of the nodes");
        if (!surface_.triangles.empty() || surface_.dropped_triangles != 0)
            kept("primitives", "triangles");
        if (!surface_.normals.empty())
            kept("NORMAL", "normals");
        if (has_vertex_colours_)
            surface_.report.push_back({"COLOR_0", Fate::converted, "sRGB, 8 bits, times the material's factor"});
        if (!surface_.texture_ids.empty())
            report_textures(surface_);
        surface_.report.insert(surface_.report.end(), report_.begin(), report_.end());
        return finished(std::move(surface_), options_);
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
                for (const std::uint16_t material : materials_of_)
                    surface_.colours.push_back(surface_.materials[material].colour);
            surface_.materials.clear();
            report_.push_back({"materials", Fate::converted, count});
            return;
        }
        if (surface_.materials.size() <= 1)
            return;
        for (const std::uint16_t material : materials_of_)
            surface_.material_ids.push_back(static_cast<std::uint8_t>(material));
    }

    GltfDocument &document_;
    const ReadOptions &options_;
    std::uint64_t most_vertices_;
    Surface surface_;
    std::vector<AttributeReport> report_;
    GltfMaterials materials_;
    std::vector<Shown> shown_;
    std::map<std::size_t, std::vector<Primitive>> meshes_;
    std::vector<std::uint16_t> materials_of_; // [vertices]
    bool has_colours_ = false, has_vertex_colours_ = false, has_factor_ = false;
};

} // namespace

bool is_gltf(std::span<const std::uint8_t> bytes) { return as_text(bytes).starts_with("glTF"); }

Result<Surface> read_gltf(const ScanFile &file, const ReadOptions &options) {
    Result<GltfDocument> document = GltfDocument::open(file);
    if (!document)
        return document.error();
    return GltfReader(*document, file.bytes.size(), options).run();
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
