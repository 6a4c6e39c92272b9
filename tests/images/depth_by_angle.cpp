#include "depth_by_angle.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace pbm {

void add_depth_errors(const PictureTruth &truth, const DrawnPicture &drawing, DepthByAngle &to) {
    const Framebuffer &drawn = drawing.picture;
    const RayImage &rays = truth.rays;
    for (std::size_t at = 0; at < drawn.pixels(); ++at) {
        if (!truth.is_interior(at) || std::isinf(drawn.depth[at]))
            continue;
        const double cosine = rays.cosines[at];
        const double off = (static_cast<double>(drawn.depth[at]) - static_cast<double>(rays.depths[at])) /
                           static_cast<double>(drawing.voxels[at]);
        if (std::abs(off) > kSeeThroughVoxels / std::max(cosine, 0.05))
            continue; // the pixel shows another part of the surface
        DepthErrors &errors = to[static_cast<std::size_t>(std::clamp(cosine * 10, 0.0, 9.0))];
        ++errors.pixels;
        errors.deep += std::abs(off) <= 1;
        errors.in_front += off < -1;
        errors.sum += off;
        errors.squared += off * off;
        errors.across += off * off * cosine * cosine;
    }
}

std::string to_text(const DepthByAngle &errors) {
    std::string text = "cosine    pixels %  within 1 voxel %  in front %   mean  deviation  along the normal\n";
    double all = 0;
    for (const DepthErrors &e : errors)
        all += static_cast<double>(e.pixels);
    for (std::size_t i = 0; i < errors.size(); ++i) {
        const DepthErrors &e = errors[i];
        const double n = std::max<double>(1, static_cast<double>(e.pixels)), mean = e.sum / n;
        std::array<char, 160> line{};
        std::snprintf(line.data(), line.size(), "%.1f..%.1f  %8.3f  %16.2f  %10.2f  %5.2f  %9.2f  %16.2f\n",
                      0.1 * static_cast<double>(i), 0.1 * static_cast<double>(i + 1), 100 * n / all,
                      percent(e.deep, e.pixels), percent(e.in_front, e.pixels), mean,
                      std::sqrt(std::max(0.0, e.squared / n - mean * mean)), std::sqrt(e.across / n));
        text += line.data();
    }
    return text;
}

} // namespace pbm
