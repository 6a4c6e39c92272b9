#include "pbm_scan/clouds/gaussian_splats.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace pbm::build {

SplatDisc disc_of(const glm::vec3 &scale, const glm::quat &rotation) {
    const float length = glm::length(rotation);
    const bool is_shape = std::isfinite(scale.x) && std::isfinite(scale.y) && std::isfinite(scale.z) && length > 0 &&
                          std::isfinite(length);
    if (!is_shape)
        return {};
    std::array<int, 3> axes{0, 1, 2};
    std::sort(axes.begin(), axes.end(), [&](int a, int b) { return std::pair(scale[a], a) < std::pair(scale[b], b); });
    glm::vec3 shortest(0);
    shortest[axes[0]] = 1;
    const float radius = std::sqrt(scale[axes[1]]) * std::sqrt(scale[axes[2]]);
    if (!(radius > 0) || !std::isfinite(radius))
        return {};
    return {.normal = glm::normalize((rotation / length) * shortest), .radius = radius};
}

Rgb8 splat_colour(const glm::vec3 &coefficients) {
    constexpr float kConstantHarmonic = 0.28209479F; // 1 / (2 sqrt(pi))
    return colour_bytes(0.5F + coefficients * kConstantHarmonic, 255.0F);
}

void turn_upright(Surface &surface) {
    for (glm::dvec3 &p : surface.positions)
        p = {p.x, -p.y, -p.z};
    for (glm::vec3 &n : surface.normals)
        n = {n.x, -n.y, -n.z};
    surface.convention = {.up = UpAxis::y, .is_firm = false, .up_reason = "Gaussian splats in PLY were turned upright"};
    surface.report.push_back(
        {"axes", Fate::converted, "y points downwards in Gaussian splats of PLY: turned by 180 degrees about x"});
}

Error all_splats_are_faint(const ReadOptions &options) {
    return bad_input(formatted("all splats are fainter than %g: there is nothing to show; --min-opacity 0 shows all",
                               options.min_opacity));
}

AttributeReport faint_splats_report(std::size_t faint, std::size_t all, const ReadOptions &options) {
    return {"opacity", Fate::converted,
            formatted("%zu of %zu splats are fainter than %g and left out, the others are opaque; --min-opacity", faint,
                      all, options.min_opacity)};
}

Status show_discs(Surface &surface, const GaussianSplats &splats, const ReadOptions &options) {
    const std::size_t count = surface.positions.size();
    surface.normals.resize(count);
    surface.radii.resize(count);
    surface.two_sided.assign(count, 1);
    for (std::size_t i = 0; i < count; ++i) {
        const SplatDisc disc = disc_of(splats.scales[i], splats.rotations[i]);
        surface.normals[i] = disc.normal;
        surface.radii[i] = disc.radius;
    }
    if (splats.opacities.empty())
        return {};
    std::vector<std::uint8_t> faint(count);
    for (std::size_t i = 0; i < count; ++i)
        faint[i] = is_faint(splats.opacities[i], options) ? 1 : 0;
    const auto number = static_cast<std::size_t>(std::count(faint.begin(), faint.end(), std::uint8_t{1}));
    if (number == count)
        return all_splats_are_faint(options);
    surface.report.push_back(faint_splats_report(number, count, options));
    if (number != 0)
        erase_vertices(surface, faint);
    return {};
}

} // namespace pbm::build
