// How true a picture is to the mesh its model was made from.
#pragma once

#include "pbm_render/framebuffer.h"
#include "pbm_render/reference_renderer.h"
#include "ray_caster.h"

#include <array>
#include <string>
#include <vector>

namespace pbm {

// Counts of pixels. "Interior" are those inside the rays' silhouette by more than 2 pixels, and not within 2 pixels of
// a ray that sees the mesh from inside: points that face away are not drawn, so an open mesh cannot be judged there.
struct FidelityFigures {
    std::uint64_t object = 0; // pixels whose ray hits the mesh
    std::uint64_t interior = 0;
    std::uint64_t holes = 0;       // interior, nothing drawn
    std::uint64_t see_through = 0; // interior, more than 4 voxels behind every hit within 2 pixels
    std::uint64_t bleed = 0;       // drawn, more than 1 pixel outside the silhouette
    std::uint64_t deep = 0;        // interior, within 1 voxel of the ray's hit
    std::uint64_t deep_near = 0;   // interior, within 1 voxel of the hits of the pixel and its neighbours

    FidelityFigures &operator+=(const FidelityFigures &other);
};

// `voxel`: the voxel edge of the level drawn, model units.
FidelityFigures compare(const RayImage &rays, const Framebuffer &drawn, double voxel);

// Eight views of the whole model: four around it at the height of its centre, four between them from 35 degrees above.
std::array<Camera, 8> eight_views(const Model &model, int width, int height);

struct View {
    RenderStatistics drawn;
    FidelityFigures figures;
    double voxel_pixels = 0; // size of a voxel of the level drawn at the centre of the model
};

// Renders and casts all eight views.
std::vector<View> measure_fidelity(const RayCaster &rays, const Model &model, int level, int width, int height,
                                   int threads);

// One line per view and one for all, aligned columns.
std::string to_text(const std::vector<View> &views);
std::string to_json(const std::vector<View> &views);

} // namespace pbm
