// Views so near to a model that its finest voxels are several pixels wide.
#pragma once

#include "ray_caster.h"

#include <span>
#include <vector>

namespace pbm {

struct CloseUp {
    Camera camera;
    double pixels_per_voxel; // at the middle of the picture
    bool slanted;            // the surface there is seen at 45 degrees, else head-on
};

// Two close-ups per view, head-on and slanted, of the place nearest to its middle that is visible in both. They take
// 4, 5, 6 and 8 pixels per `voxel` (model units) in turn. A view without such a place gives none.
std::vector<CloseUp> close_ups(const RayCaster &rays, std::span<const Camera> views, double voxel, int width,
                               int height);

} // namespace pbm
