// A scan as plain arrays: what every reader delivers and what the pipeline samples.
#pragma once

#include "system/error.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// Reflection coefficients of one material (dissertation section 4.6, Phong). Colour is sRGB 0..255.
struct SurfaceMaterial {
    float ka = 0.2F, kd = 0.7F, ks = 0.1F, power = 16.0F;
    std::array<std::uint8_t, 3> colour{204, 204, 204};
    float environment = 0.0F; // blending factor 0..1
};

// What became of one attribute of the input file.
struct AttributeReport {
    enum class Fate : std::uint8_t { kept, converted, dropped, estimated };
    std::string name; // as the input names it, e.g. "vertex.confidence"
    Fate fate = Fate::kept;
    std::string note;    // what it became, or why it was dropped
    std::string input{}; // which of several inputs; empty where there is only one
};

// Arrays run in parallel with `positions`, or are empty where the input has no such attribute.
struct Surface {
    std::string name;                  // which of several inputs, for reports; empty where there is only one
    std::vector<glm::dvec3> positions; // model units, all finite
    std::vector<glm::uvec3> triangles; // indices < positions.size(), three different ones; wound as in the file
    std::vector<glm::vec3> normals;    // as given, any length; zero length means "none here"
    std::vector<std::array<std::uint8_t, 3>> colours; // sRGB
    std::vector<float> radii;                         // splat radius, model units; 0: none here
    std::vector<std::uint8_t> two_sided;              // 1: the point shows both of its sides
    std::vector<std::uint8_t> material_ids;           // < materials.size()
    std::vector<SurfaceMaterial> materials;           // empty: the default material
    std::vector<AttributeReport> report;              // in the order of the file
    std::uint64_t dropped_vertices = 0;               // not finite
    std::uint64_t dropped_triangles = 0;              // fewer than three different corners, or at a dropped vertex
    std::uint64_t input_bytes = 0;                    // of the file

    // Beside triangles: the last so many positions belong to none and are points of their own (merge_surfaces.h).
    std::size_t points_beside_triangles = 0;

    // Where every coordinate is a number of single precision: how far two of them are apart, model units, where they
    // are largest, and the largest, as the file has it. 0: not so. Set by `place` (placement.h).
    double float_step = 0, float_near = 0;

    // Points of their own stand last: all positions where there are no triangles.
    std::size_t point_count() const { return triangles.empty() ? positions.size() : points_beside_triangles; }
    std::size_t first_point() const { return positions.size() - point_count(); }
};

// What a vertex has a byte of, the same in a PLY file as in memory.
struct ByteAttribute {
    std::string_view property; // of a PLY vertex, uchar
    std::string_view note;     // for the report
    std::vector<std::uint8_t> Surface::*values;
};
inline constexpr std::array kByteAttributes{
    ByteAttribute{"two_sided", "points that show both of their sides", &Surface::two_sided}};

// Calls `visit` with each array of attributes of vertices, the same one of all `surfaces`.
template <class Visit, class... Surfaces> void for_vertex_attributes(Visit &&visit, Surfaces &...surfaces) {
    visit(surfaces.normals...);
    visit(surfaces.colours...);
    visit(surfaces.radii...);
    visit(surfaces.material_ids...);
    for (const ByteAttribute &attribute : kByteAttributes)
        visit(surfaces.*attribute.values...);
}

enum class ScanFormat : std::uint8_t { ply, obj, off, stl };

// What a caller may ask of every reader.
struct ReadOptions {
    bool strict = false;                       // refuse (`bad_input`) instead of dropping anything
    std::optional<ScanFormat> format{};        // surface_reader.h: where neither content nor name tells
    SurfaceMaterial default_material{};        // what a material of the file does not say
    std::function<void(double done)> progress; // called now and then from the calling thread, 0..1; may be empty
};

// The last step of every reader: removes vertices with a coordinate that is not finite, with everything that hangs on
// them, and counts them; with ReadOptions::strict refuses a surface that is less than the file said.
//
// errors  bad_input  no vertex is left; with `strict` something was dropped
Result<Surface> finished(Surface surface, const ReadOptions &options);

} // namespace pbm::build
