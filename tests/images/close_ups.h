// Views so near to a model that its finest voxels are several pixels wide.
#pragma once

#include "ray_caster.h"

#include <span>
#include <vector>

namespace pbm {

struct CloseUp {
    Camera camera;
    double pixels_per_voxel; // in the middle of the picture
    bool slanted;            // the surface there is seen at 45 degrees, else front-on
};

// Two for each view: of the place nearest to its middle that the eye can look at both ways, at 4, 5, 6 and 8 pixels per
// `voxel` (model units) in turn. Views that show no such place have none.
std::vector<CloseUp> close_ups(const RayCaster &rays, std::span<const Camera> views, double voxel, int width,
                               int height);

} // namespace pbm
