// The body of a PLY file as columns: the raw numbers of every property with a role.
#pragma once

#include "pbm_scan/ply/ply_roles.h"
#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm::build {

// Every array has one entry per vertex, finite or not, or is empty if no property has the role.
struct PlyBody {
    std::vector<glm::dvec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<std::array<std::uint8_t, 3>> colours; // where all three are uchar
    std::vector<glm::vec3> wide_colours;              // where they are not: as in the file
    std::vector<float> radii;
    std::vector<float> material_ids; // as in the file, unchecked
    std::array<std::vector<std::uint8_t>, kByteAttributes.size()> bytes;
    std::array<std::vector<float>, 8> splat;       // PlyRoles::splat, as in the file; empty: absent, or a field
    std::vector<glm::vec3> face_colours;           // [triangles] as in the file, or kNoColour; empty: no face has one
    std::vector<glm::uvec3> triangles;             // indices in range, three different ones
    std::vector<std::uint32_t> grid_cells;         // of a range image, row by row: an index in range or kEmptyCell
    std::vector<std::array<double, 10>> materials; // in the order of PlyRole, from ka to tint; NaN where absent
    std::vector<glm::vec2> places;                 // u v of the vertices
    std::vector<std::vector<double>> fields;       // [properties with that role]
    std::vector<TextureCorners> corner_places;     // [triangles] u v as in the file; empty if no face has any
    std::vector<std::int32_t> images;              // [triangles] number of the image, -1: none; empty: all have image 0
    std::uint64_t degenerate_triangles = 0;        // faces and fan triangles with fewer than three different corners
    std::size_t end_offset = 0;                    // first byte after the last element
};

constexpr std::uint64_t kMaxPlyVertices = 0xfffffffe; // so that an index fits 32 bits
constexpr std::uint64_t kMaxPlyMaterials = 8;

// Reads everything after the header. `bytes` is the whole file, `roles` are those of the header. Verifies the counts
// against the size of the file before it allocates; the result takes at most a small multiple of that size (24 bytes
// per vertex, 12 per triangle). In ASCII a row may span lines, but must end at a line end.
//
// errors  bad_input  a count beyond the size of the file, a truncated body, text that is no number, a value out of its
//                    type's range, a row with too many values, a vertex index out of range, more than one vertex in a
//                    cell of a range grid, coordinates that are valid only in the other byte order (ply_damage.h)
//         too_large  more vertices or materials than the limits above
Result<PlyBody> read_ply_body(std::span<const std::uint8_t> bytes, const PlyHeader &header, const PlyRoles &roles,
                              const ReadOptions &options);

} // namespace pbm::build
