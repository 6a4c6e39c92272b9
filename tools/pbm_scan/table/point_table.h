// Points as a table: columns with names, as PCD files and text files have them.
#pragma once

#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// What a column holds.
enum class ColumnRole : std::uint8_t {
    none,
    x,
    y,
    z,
    nx,
    ny,
    nz,
    red,
    green,
    blue,
    packed_colour,
    intensity,
    field // the first one that is kept; the next numbers are further ones
};

// The role of each column by its name: x y z (without x and y also lon lat height, which are degrees), nx ny nz,
// normal_x ..., r g b, red ..., Rf Gf Bf, rgb, rgba, intensity, i, in any case. The first column of a role counts;
// groups of three must be whole.
std::vector<ColumnRole> roles_of(const std::vector<std::string> &names);

// Points of a table; arrays are as long as `positions`, or empty.
struct PointTable {
    std::vector<glm::dvec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec3> colours;    // as in the file: 0..1, 0..255 or 0..65,535 (conventions/colour_range.h)
    std::vector<std::uint32_t> packed; // 0xRRGGBB
    std::uint64_t missing_packed = 0;  // of these, black for want of a whole number of 32 bits
    std::vector<double> intensities;
    std::vector<std::vector<double>> fields; // [those that are kept]

    // Makes room for `count` points of the columns with these roles.
    void resize(std::size_t count, const std::vector<ColumnRole> &roles);
    // Stores one number; none: ignored.
    void set(std::size_t point, ColumnRole role, double value);
};

// A column that is kept as a field.
struct KeptColumn {
    std::size_t column; // of the names
    FieldColumn values;
};

// Finds the columns that are kept: the intensity, and columns without a role, which get that of a field.
std::vector<KeptColumn> keep_fields(const std::vector<std::string> &names, std::vector<ColumnRole> &roles,
                                    const ReadOptions &options, Surface &surface);

// Points without finite coordinates are left out and counted. Without colours the intensity is shown as grey. `names`
// and `roles`: of the columns, for the report; `kept`: of `surface`, which gets the points.
void fill_surface(PointTable table, const std::vector<std::string> &names, const std::vector<ColumnRole> &roles,
                  std::span<const KeptColumn> kept, Surface &surface);

} // namespace pbm::build
