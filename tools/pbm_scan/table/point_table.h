// A table of points, one row for each, in columns with names: the content of PCD files and of text files.
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

// The attribute that a column holds.
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
    field // column i of PointTable::fields has the role field + i
};

// The role of each column, by its name: x y z (without x and y also lon lat height, which are
// degrees), nx ny nz, normal_x ..., r g b, red ..., Rf Gf Bf, rgb, rgba, intensity,
// i. Upper and lower case are equal. Of several columns with one role the first has it. A group of three counts only if
// it is complete.
std::vector<ColumnRole> roles_of(const std::vector<std::string> &names);

// The values of a table, by role. Every array has one value per point, or is empty if no column has its role.
struct PointTable {
    std::vector<glm::dvec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec3> colours;    // as in the file: 0..1, 0..255 or 0..65,535 (conventions/colour_range.h)
    std::vector<std::uint32_t> packed; // 0xRRGGBB
    std::uint64_t missing_packed = 0;  // how many of `packed` are black because the file had no finite number
    std::vector<double> intensities;
    std::vector<std::vector<double>> fields; // [kept columns][points]

    // Resizes the arrays of these roles to `count` points.
    void resize(std::size_t count, const std::vector<ColumnRole> &roles);
    // Stores one number of a row. Ignores a column with ColumnRole::none.
    void set(std::size_t point, ColumnRole role, double value);
};

// A column that becomes a field of the surface.
struct KeptColumn {
    std::size_t column; // index of its name
    FieldColumn values;
};

// Chooses the columns that become fields, as `options` ask: the intensity, and columns without a role. The latter get
// the role of a field in `roles`.
std::vector<KeptColumn> keep_fields(const std::vector<std::string> &names, std::vector<ColumnRole> &roles,
                                    const ReadOptions &options, Surface &surface);

// Moves the points into `surface`, with the fields `kept`. Leaves out points without finite coordinates, and counts
// them. If the table has no colours, the intensity becomes a grey. `names` and `roles` of the columns are for the
// report.
void fill_surface(PointTable table, const std::vector<std::string> &names, const std::vector<ColumnRole> &roles,
                  std::span<const KeptColumn> kept, Surface &surface);

} // namespace pbm::build
