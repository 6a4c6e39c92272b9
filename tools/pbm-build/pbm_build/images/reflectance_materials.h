// Materials of the model from images that say how each place reflects, and what light it emits and lacks.
// Based on: Lloyd. Least Squares Quantization in PCM. 1982
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <cstddef>

namespace pbm::build {

// Replaces the materials of a surface, some of whose triangles have images of reflectance, by at most `max_materials`
// (at least 2), and fills Surface::material_of_cell. They are the centres of clusters of what the surface shows
// (surface_looks.h), which its area weights, and of materials that have no reflectance the first ones. Does nothing if
// no triangle has such an image. Where the surface emits a share s of its colour, and a share o of ambient light
// arrives, ka becomes s + (1 - s) o ka, and kd (1 - s) kd.
//
// The result does not depend on threads, nor on the order of triangles.
void choose_reflectances(Surface &surface, const Material &usual, std::size_t max_materials, int threads,
                         BuildStatistics &statistics);

// Removes the images of reflectance, emission and occlusion.
void drop_reflectances(Surface &surface);

} // namespace pbm::build
