// Primitives of glTF meshes: arrays of vertices, and triangles.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (section 3.7)
#pragma once

#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/gltf/gltf_document.h"
#include "pbm_scan/gltf/gltf_materials.h"
#include "pbm_scan/gltf/gltf_scene.h"
#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace pbm::build {

// A part of a mesh in its own coordinates. Arrays are parallel to `positions`, or empty.
struct GltfPrimitive {
    std::vector<float> positions, normals, tangents, colours; // 3, 3, 4, 4 numbers each; colours linear
    std::map<std::string, std::vector<float>> places;         // in images, by the name of the attribute; 2 numbers each
    std::vector<float> radii;                                 // of Gaussian splats; 0: not known
    std::vector<float> joints, weights;                       // numbers per vertex: 4 joint_sets
    std::size_t joint_sets = 0;
    std::vector<glm::uvec3> triangles;
    bool is_points = false, is_lines = false, are_splats = false;
    const GltfMaterial *material = nullptr;
    std::size_t degenerate = 0;

    std::size_t vertices() const { return positions.size() / 3; }
    // Where the vertices lie in an image of the material; null: in none, or the image cannot be read.
    const std::vector<float> *places_in(const GltfImage &image) const {
        const auto found = places.find(image.coordinates);
        const bool is_there = image.texture != Surface::kNoTexture && found != places.end() && !found->second.empty();
        return is_there ? &found->second : nullptr;
    }
};

class GltfPrimitives {
  public:
    // `report` gets lines for what is dropped.
    GltfPrimitives(GltfDocument &document, GltfMaterials &materials, const ReadOptions &options,
                   std::vector<AttributeReport> &report);

    // The primitives of a mesh, with morph targets of its weights, and with joints if a skin moves it. Each is read
    // once. A primitive that shares an accessor with others, and names few of its vertices, has those alone: time and
    // memory are bounded by the indices of the file.
    //
    // errors  bad_input  damaged
    //         too_large  many more vertices or indices than the file has bytes
    Result<const std::vector<GltfPrimitive> *> of_mesh(const ShownMesh &shown);

    // Reports Gaussian splats, if there are any. Call it last.
    //
    // errors  bad_input  `are_alone`, the scene has no other points, and all splats are faint
    Status report_splats(bool are_alone);

    // That of COLOR_0 of all primitives read so far.
    ColourRange colour_range() const;

    // Reports vertices of shared accessors that no primitive names, and takes back what was said of texture coordinates
    // that other primitives use. Call it last.
    void finish_report();

    // Limit of vertices, also of all instances together.
    std::uint64_t max_vertices() const;

  private:
    // The vertices of an accessor of positions that several primitives share.
    struct Shared {
        std::vector<std::uint32_t> numbers, round; // [vertices] in the primitive that is read; valid in the same round
        std::vector<bool> is_named;
        std::uint32_t rounds = 0;
        bool are_all_named = false;
    };
    struct Reading {
        const Json &described, &attributes;
        const std::vector<double> &weights;
        bool has_skin;
        std::vector<std::uint32_t> corners;
        std::vector<std::uint32_t> sources; // the vertex of the accessor for each one, if is_compact
        bool is_compact = false;
    };

    Result<std::vector<GltfPrimitive>> read_mesh(std::size_t mesh, const std::vector<double> &weights, bool has_skin);
    Status read_primitive(const Json &described, const std::vector<double> &weights, bool has_skin, GltfPrimitive &out);
    Status read_plain(Reading &reading, GltfPrimitive &out);
    Status read_compressed(const Json &draco, Reading &reading, GltfPrimitive &out);
    Status read_corners(Reading &reading, const GltfPrimitive &out);
    static void compact(Reading &reading, Shared &vertices);
    Status read_attribute(Reading &reading, const Json &from, const char *name, std::size_t components,
                          std::vector<float> &to);
    Status read_splats(Reading &reading, GltfPrimitive &out);
    Status read_joints(Reading &reading, GltfPrimitive &out);
    Status morph(Reading &reading, GltfPrimitive &out);
    void report_attributes(const Json &attributes, const GltfPrimitive &out, bool has_skin);

    GltfDocument &document_;
    GltfMaterials &materials_;
    const ReadOptions &options_;
    std::vector<AttributeReport> &report_;
    std::set<std::string> used_, unused_; // attributes that some primitive needs, or does not
    std::map<std::tuple<std::size_t, std::vector<double>, bool>, std::vector<GltfPrimitive>> meshes_;
    std::map<std::size_t, std::size_t> uses_;                                  // of accessors of positions
    std::map<std::size_t, Shared> shared_;                                     // by the accessor of positions
    std::map<std::pair<std::size_t, std::size_t>, std::vector<float>> values_; // by accessor and components, of these
    std::size_t splats_ = 0, faint_splats_ = 0;
    std::uint64_t vertices_ = 0, corners_ = 0; // read so far
};

} // namespace pbm::build
