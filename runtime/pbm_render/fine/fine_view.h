// What all samples of a picture share, and how their blended pixels are shaded.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/drawn_runs.h"
#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/fine/surface_points.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/shading/surface_shader.h"
#include "pbm_render/surroundings/surroundings_view.h"

#include <glm/vec2.hpp>

#include <cstdint>
#include <vector>

namespace pbm {

// A pixel with blended points.
struct BlendedPixel {
    int x, y;
    float depth;       // grid edges
    const float *sums; // [channels]
    std::uint32_t id;  // of the visible point
};

struct FineView {
    FineView(const ModelParameters &parameters, const Appearance &look, const Surroundings *surroundings,
             const Camera &camera, const RenderOptions &asked, const Framebuffer &target);
    FineView(const FineView &) = delete;
    FineView &operator=(const FineView &) = delete;

    // Rays through the centres of the pixels, or through a sample of each.
    EyeRays rays(glm::dvec2 offset = {}) const {
        return {geometry.middle_x - static_cast<float>(offset.x), geometry.middle_y - static_cast<float>(offset.y),
                geometry.inverse_focal};
    }
    // Appends a pixel to the row that is shaded next. `runs`: of the visible point.
    void collect(const BlendedPixel &pixel, const EyeRays &rays, const DrawnRuns &runs, SurfaceRow &row) const;
    // Turns the colours of row `y` into light towards the eye, with what materials mirror.
    void shade(int y, const EyeRays &rays, SurfaceRow &row) const;

    const int width, height;
    const bool with_depths;
    const RenderOptions options;
    const Projection projection;
    const FrameGeometry geometry; // of the pixels' centres
    const Appearance appearance;
    const SurroundingsView around;
    const SurfacePoints points;
    const std::vector<EyeLight> lights;

  private:
    void read_visible_point(const BlendedPixel &pixel, const EyeRays &rays, const DrawnRuns &runs,
                            SurfacePoint &to) const;
    void mirror(float screen_y, const EyeRays &rays, SurfaceRow &row) const;
};

} // namespace pbm
