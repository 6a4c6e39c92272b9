// Colours of vertices from their materials.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <algorithm>

namespace pbm::build {

// Gives vertices the colours of their materials where no vertex has a colour, and
//   - some triangles have an image or a colour of their own, and others may have none,
//   - images of reflectance are about to replace materials of several colours, or
//   - emission is added to the colours.
inline void colour_by_materials(Surface &surface) {
    const auto is_given = [](const FaceColour &colour) { return colour.is_given; };
    const std::vector<FaceColour> &of_faces = surface.face_colours;
    const bool are_replaced =
        !surface.layer(Layer::reflectance).ids.empty() &&
        std::any_of(surface.materials.begin(), surface.materials.end(),
                    [&](const Material &material) { return material.colour != surface.materials.front().colour; });
    const bool are_mixed =
        !surface.texture_ids.empty() || are_replaced || !surface.layer(Layer::emission).ids.empty() ||
        (!of_faces.empty() && (surface.point_count() != 0 || !std::all_of(of_faces.begin(), of_faces.end(), is_given)));
    if (!are_mixed || !surface.colours.empty())
        return;
    const std::vector<Material> materials = surface.materials.empty() ? std::vector<Material>(1) : surface.materials;
    surface.colours.assign(surface.positions.size(), materials.front().colour);
    for (std::size_t i = 0; i < surface.material_ids.size(); ++i)
        surface.colours[i] = materials[surface.material_ids[i]].colour;
}

} // namespace pbm::build
