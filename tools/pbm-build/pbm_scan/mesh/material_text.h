// Material files (MTL) of OBJ files.
// Based on: Wavefront. Advanced Visualizer manual, MTL material format. 1995
#pragma once

#include "pbm_scan/surface/surface.h"

#include <string_view>

namespace pbm::build {

// Larger material files are not read.
inline constexpr std::size_t kMaxMaterialBytes = std::size_t{1} << 20;

// Appends the materials of a file to `materials`, and a line to `report` for each statement that is not kept as it is.
//   Kd  the colour, as sRGB: what viewers show
//   Ks  ks, the mean of its channels
//   Ns  power, 1..1024
// Values that the file does not set are those of `default_material`. Statements that make no sense are dropped.
void read_materials(std::string_view text, const Material &default_material, std::vector<NamedMaterial> &materials,
                    std::vector<AttributeReport> &report);

} // namespace pbm::build
