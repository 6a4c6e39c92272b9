// Materials of the model from images that say how each place reflects.
// Based on: Lloyd. Least Squares Quantization in PCM. 1982
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <cstdint>

namespace pbm::build {

// Images of reflectance are read in cells of 32 x 32 x 32.
inline constexpr std::size_t kReflectanceCells = std::size_t{1} << 15;
// `texel`: three numbers, 0..65,535.
inline std::size_t reflectance_cell(const std::array<std::int32_t, 3> &texel) {
    const auto part = [&](std::size_t c) { return static_cast<std::size_t>(texel[c]) >> 11; };
    return part(0) << 10 | part(1) << 5 | part(2);
}

// Replaces the materials of a surface, some of whose triangles have images of reflectance, by at most `max_materials`
// (at least 2), and fills Surface::material_of_cell. They are the centres of clusters, which the area of the surface
// weights, and of materials that have no reflectance the first ones. Does nothing if no triangle has such an image.
//
// The result does not depend on threads, nor on the order of triangles.
void choose_reflectances(Surface &surface, const Material &usual, std::size_t max_materials, int threads,
                         BuildStatistics &statistics);

// Removes the images of reflectance.
void drop_reflectances(Surface &surface);

} // namespace pbm::build
