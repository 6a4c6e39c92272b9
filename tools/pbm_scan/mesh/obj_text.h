// The statements of an OBJ file as arrays.
// Based on: Alias|Wavefront. Advanced Visualizer manual, appendix B1. 1995
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// The material of the faces from `first_face` on.
struct MaterialRun {
    std::size_t first_face = 0;
    std::uint16_t material = 0;
};
inline constexpr std::uint16_t kNoMaterial = std::numeric_limits<std::uint16_t>::max();

// The smoothing group of the faces from `first_face` on: 0 where they are flat.
struct SmoothingRun {
    std::size_t first_face = 0;
    std::uint32_t group = 0;
};

struct ObjText {
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

    std::vector<glm::dvec3> positions; // may be not finite
    std::vector<glm::vec3> colours;    // as in the file, kNoColour where a vertex has none; empty: none has one
    std::vector<glm::vec3> normals;    // `vn`; as many as positions if no face names them; those that are not finite: 0
    std::vector<glm::vec2> texture_coordinates; // `vt`

    // Faces of three or more different corners. All indices count from 0. Those of vertices exist; those of normals and
    // texture coordinates that do not exist are kNone.
    std::vector<std::uint32_t> face_sizes;
    std::vector<std::uint32_t> corners;                         // vertices, one face after the other
    std::vector<std::uint32_t> corner_normals, corner_textures; // [corners] or kNone; empty if no corner names one
    std::uint64_t dropped_faces = 0;                            // of fewer than three different corners
    std::vector<std::string> materials;                         // by name, at most kNoMaterial
    std::vector<MaterialRun> material_runs;
    std::vector<SmoothingRun> smoothing_runs; // empty: the file has no statement `s`
    std::vector<std::string> material_lines;  // what `mtllib` names, a line each; at most kMaxFurtherFiles
    std::vector<AttributeReport> report;
};

// Prefix of the names of report lines about `mtllib`.
inline constexpr std::string_view kMaterialsLine = "materials and textures ";

// A file truncated between two lines is detected only if its comments announce counts.
//
// errors  bad_input  NUL bytes; text that is no number, index or statement; an index out of range; counts in comments
//                    that do not fit the file
//         too_large  more than 2^31 - 1 vertices
Result<ObjText> read_obj_text(std::string_view text, const ReadOptions &options);

// ObjText::material_lines alone, without reading the rest.
std::vector<std::string> material_lines_of(std::string_view text);

} // namespace pbm::build
