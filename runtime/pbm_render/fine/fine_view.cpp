#include "pbm_render/fine/fine_view.h"

#include "pbm_render/camera/unit_grid.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm {

FineView::FineView(const ModelParameters &parameters, const Appearance &look, const Surroundings *surroundings,
                   const Camera &camera, const RenderOptions &asked, const Framebuffer &target)
    : width(target.width), height(target.height), with_depths(!target.depth.empty()), options(asked),
      projection(in_unit_grid(camera, parameters), target.width, target.height),
      geometry(projection, target.width, target.height),
      appearance(appearance_in_frame(parameters, options, projection.axes, look)),
      around(surroundings, appearance, projection, options),
      points(parameters, appearance, options, around.has_reflections()),
      lights(lights_in_eye_space(appearance.lights, parameters.grid.edge(), projection)) {}

// Reads the visible point of a pixel that has no usable sums.
void FineView::read_visible_point(const BlendedPixel &pixel, const EyeRays &rays, const DrawnRuns &runs,
                                  SurfacePoint &to) const {
    const PointRun &run = runs[runs.ids().run(pixel.id)];
    const std::size_t i = runs.ids().point(pixel.id);
    const std::uint16_t stored = run.chunk->normals[i];
    const EyeNormal &n = geometry.normals[static_cast<std::size_t>(stored & geometry.normal_mask)];
    const float facing = n.x * (static_cast<float>(pixel.x) + 0.5F - rays.middle_x) * rays.inverse_focal +
                         n.y * (static_cast<float>(pixel.y) + 0.5F - rays.middle_y) * rays.inverse_focal + n.z;
    const bool turn = PointIds::is_back(pixel.id) || ((stored & kTwoSidedBit) != 0 && facing > 0);
    const float sign = turn ? -1.0F : 1.0F;
    to.channels[channel::kNormal] = sign * n.x;
    to.channels[channel::kNormal + 1] = sign * n.y;
    to.channels[channel::kNormal + 2] = sign * n.z;
    to.channels[channel::kWeight] = 1;
    points.read(run, i, to);
}

void FineView::collect(const BlendedPixel &pixel, const EyeRays &rays, const DrawnRuns &runs, SurfaceRow &row) const {
    const std::size_t to = row.count++;
    const float *sums = pixel.sums;
    // Sums with less weight, or with normals that cancel each other, are not usable.
    constexpr float kMinWeight = 1e-3F, kMinNormal2 = 1e-2F;
    const auto length2 = [&] { return sums[0] * sums[0] + sums[1] * sums[1] + sums[2] * sums[2]; };
    SurfacePoint alone;
    if (const float weight = sums[channel::kWeight]; weight < kMinWeight || length2() < kMinNormal2 * weight * weight) {
        read_visible_point(pixel, rays, runs, alone);
        sums = alone.channels.data();
    }
    const float inverse = 1 / sums[channel::kWeight], inverse_length = 1 / std::sqrt(length2());
    row.x[to] = pixel.x;
    row.screen_x[to] = static_cast<float>(pixel.x) + 0.5F;
    row.depth[to] = pixel.depth;
    for (std::size_t k = 0; k < 3; ++k) {
        row.normal[k][to] = sums[channel::kNormal + k] * inverse_length;
        row.colour[k][to] = sums[channel::kColour + k] * inverse;
    }
    row.environment[to] = sums[channel::kEnvironment] * inverse;
    if (points.tints()) // before the row is lit
        for (std::size_t k = 0; k < 3; ++k)
            row.tint[k][to] = sums[channel::kTint] * inverse * (1 - row.colour[k][to]);
    const Material &material = appearance.materials[0];
    const std::array<float, 4> same_phong{material.ka, material.kd, material.ks, material.power};
    for (std::size_t k = 0; k < 4; ++k)
        row.phong[k][to] = points.has_phong() ? sums[channel::kPhong + k] * inverse : same_phong[k];
    for (std::size_t light = 0; light < points.shadowed(); ++light)
        row.lit[light][to] = std::clamp(sums[channel::kLit + light] * inverse, 0.0F, 1.0F);
}

void FineView::shade(int y, const EyeRays &rays, SurfaceRow &row) const {
    const float screen_y = static_cast<float>(y) + 0.5F;
    shade_row(rays, lights, points.shadowed(), screen_y, row);
    if (around.has_reflections())
        mirror(screen_y, rays, row);
}

// Blends the panorama's light along the mirrored ray into a row.
void FineView::mirror(float screen_y, const EyeRays &rays, SurfaceRow &row) const {
    const EyeAxes &axes = projection.axes;
    const auto right = glm::vec3(axes.right), down = glm::vec3(-axes.up), forward = glm::vec3(axes.forward);
    const auto normal = [&](std::size_t i) { return glm::vec3(row.normal[0][i], row.normal[1][i], row.normal[2][i]); };
    for (std::size_t i = 0; i < row.count; ++i) {
        const float factor = row.environment[i];
        if (factor <= 0)
            continue;
        const glm::vec3 n = normal(i);
        const glm::vec3 ray = glm::normalize(glm::vec3((row.screen_x[i] - rays.middle_x) * rays.inverse_focal,
                                                       (screen_y - rays.middle_y) * rays.inverse_focal, 1));
        const glm::vec3 turned = ray - 2 * glm::dot(n, ray) * n;
        // The mirrored ray turns by twice the angle between the normals of neighbouring pixels, edges excluded.
        float turn = 1;
        if (i > 0 && row.x[i] == row.x[i - 1] + 1)
            turn = glm::distance(n, normal(i - 1));
        if (i + 1 < row.count && row.x[i + 1] == row.x[i] + 1)
            turn = std::min(turn, glm::distance(n, normal(i + 1)));
        const glm::vec3 direction = right * turned.x + down * turned.y + forward * turned.z;
        const Float4 seen = around.reflection(direction, 2 * turn + rays.inverse_focal);
        for (std::size_t k = 0; k < 3; ++k) {
            float &colour = row.colour[k][i];
            const float mirrored = seen[static_cast<int>(k)];
            colour += factor * (mirrored - colour);
            if (points.tints())
                colour -= row.tint[k][i] * mirrored;
        }
    }
}

} // namespace pbm
