// The header of a PLY file: its elements, properties and encoding. Counts are untrusted; ply_body.h verifies them
// against the size of the file.
// Based on: Turk. The PLY polygon file format. 1994
#pragma once

#include "system/error.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

enum class PlyEncoding : std::uint8_t { ascii, little_endian, big_endian };
// As in a format line.
inline constexpr std::array<std::string_view, 3> kEncodingNames{"ascii", "binary_little_endian", "binary_big_endian"};

enum class PlyScalar : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t size_of(PlyScalar type); // bytes in a binary file
std::string_view to_string(PlyScalar type);
inline bool is_float(PlyScalar type) { return type >= PlyScalar::float32; }

// The meaning of a property, set by resolve_roles (ply_roles.h). Groups of three are in order.
enum class PlyRole : std::uint8_t {
    none, // skipped by its size
    x,
    y,
    z,
    nx,
    ny,
    nz,
    red, // of a vertex or of a face
    green,
    blue,
    radius,
    material_index,
    byte,  // one of kByteAttributes (surface.h)
    splat, // of the shape of a Gaussian splat: one of PlyRoles::splat
    field, // a number that is kept as a field (field_column.h)
    u,     // of a vertex: place in the image
    v,
    corners,       // list of vertex indices: a polygon of `face`, strips of `tristrips`, a cell of `range_grid`
    corner_places, // list of u v of the corners of a face
    image,         // number of the image of a face
    ka,
    kd,
    ks,
    power,
    clr_r,
    clr_g,
    clr_b,
    envmapfactor,
    shape,
    tint,
};

enum class PlyKind : std::uint8_t { skipped, vertex, face, tristrips, range_grid, material };

struct PlyProperty {
    std::string name;
    PlyScalar type = PlyScalar::float32; // of the value, or of one list entry
    bool is_list = false;
    PlyScalar count_type = PlyScalar::uint8; // of a list
    PlyRole role = PlyRole::none;
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0; // untrusted
    std::vector<PlyProperty> properties;
    PlyKind kind = PlyKind::skipped;
    std::uint64_t line = 0; // of the header, from 1
    std::size_t offset = 0; // of that line
};

bool has_lists(const PlyElement &element);
std::size_t min_row_size(const PlyElement &element, bool text); // bytes; a row without lists takes just that (binary)

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::ascii;
    std::vector<PlyElement> elements;       // in the order of the file; names are unique, also those of properties
    std::vector<std::string> texture_files; // "comment TextureFile NAME", as MeshLab writes it; at most kMaxPlyTextures
    std::size_t further_textures = 0;       // such comments beyond these
    std::uint64_t grid_columns = 0;         // "obj_info num_cols N" of a range image; 0: not given
    std::uint64_t grid_rows = 0;            // "obj_info num_rows N"
    std::size_t unknown_lines = 0;          // of an ASCII file, with a keyword that means nothing
    std::string first_unknown;              // such a keyword
    std::size_t body_offset = 0;            // first byte after the line of end_header
    std::uint64_t body_line = 0;            // its line number, from 1
};

constexpr std::size_t kMaxPlyHeaderBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxPlyTextures = 16; // that are named
constexpr std::size_t kMaxPlyElements = 256;
constexpr std::size_t kMaxPlyProperties = 256; // per element

// Whether the bytes begin with the word "ply" and a line end.
bool is_ply(std::span<const std::uint8_t> bytes);

// Reads the header. Lines end in LF, CR LF or CR. `comment` and `obj_info` may occur anywhere in the header, and only
// there, as in Turk's reader. Unknown keywords are skipped in an ASCII file, as in Turk's reader (scans of the Stanford
// repository have some), because a lost property shows in its rows; in a binary file they are refused, because the body
// would be misread silently.
//
// errors  bad_input            not a PLY file, no end_header, an unknown keyword or type, a bad or duplicate
//                              name or count
//         too_large            over one of the limits above
//         unsupported_version  a format version other than 1.0
Result<PlyHeader> read_ply_header(std::span<const std::uint8_t> bytes);

// "line 4: ", the line of the header that announces the element.
std::string in_line(const PlyElement &element);

} // namespace pbm::build
