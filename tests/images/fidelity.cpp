#include "fidelity.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace pbm {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();
constexpr double kSeeThroughVoxels = 4;

struct DepthRange {
    float nearest = kEmpty, farthest = -kEmpty;
};

// Least and greatest of the (2 * reach + 1)^2 pixels around (x, y); beyond the border is empty.
DepthRange range_around(const std::vector<float> &depths, int width, int height, int x, int y, int reach) {
    DepthRange range;
    for (int v = y - reach; v <= y + reach; ++v) {
        for (int u = x - reach; u <= x + reach; ++u) {
            const bool inside = u >= 0 && v >= 0 && u < width && v < height;
            const float depth = inside ? depths[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                                                static_cast<std::size_t>(u)]
                                       : kEmpty;
            range.nearest = std::min(range.nearest, depth);
            range.farthest = std::max(range.farthest, depth);
        }
    }
    return range;
}

double percent(std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

} // namespace

FidelityFigures &FidelityFigures::operator+=(const FidelityFigures &o) {
    object += o.object;
    interior += o.interior;
    holes += o.holes;
    see_through += o.see_through;
    bleed += o.bleed;
    deep += o.deep;
    deep_near += o.deep_near;
    return *this;
}

FidelityFigures compare(const RayImage &image, const Framebuffer &drawn, double voxel) {
    const std::vector<float> &rays = image.depths;
    // As a picture with holes where the mesh is seen from inside: one test for both kinds of border.
    std::vector<float> outside = rays;
    for (std::size_t i = 0; i < outside.size(); ++i)
        outside[i] = image.inside[i] != 0 ? kEmpty : outside[i];
    FidelityFigures figures;
    std::size_t at = 0;
    for (int y = 0; y < drawn.height; ++y) {
        for (int x = 0; x < drawn.width; ++x, ++at) {
            const float depth = drawn.depth[at];
            if (rays[at] == kEmpty) {
                figures.bleed +=
                    depth != kEmpty && range_around(rays, drawn.width, drawn.height, x, y, 1).nearest == kEmpty;
                continue;
            }
            ++figures.object;
            const DepthRange around = range_around(outside, drawn.width, drawn.height, x, y, 2);
            if (around.farthest == kEmpty)
                continue;
            ++figures.interior;
            if (depth == kEmpty) {
                ++figures.holes;
                continue;
            }
            const DepthRange next = range_around(rays, drawn.width, drawn.height, x, y, 1);
            figures.see_through += depth > around.farthest + kSeeThroughVoxels * voxel;
            figures.deep += std::abs(depth - rays[at]) <= voxel;
            figures.deep_near += depth >= next.nearest - voxel && depth <= next.farthest + voxel;
        }
    }
    return figures;
}

std::array<Camera, 8> eight_views(const Model &model, int width, int height) {
    const Camera front = default_camera(model, width, height);
    const glm::dvec3 out = front.position - front.focal_point;
    const glm::dvec3 side = glm::cross(glm::normalize(front.up), out);
    std::array<Camera, 8> views;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const double azimuth =
            glm::radians(i < 4 ? 90.0 * static_cast<double>(i) : 90.0 * static_cast<double>(i) - 315);
        const double elevation = glm::radians(i < 4 ? 0.0 : 35.0);
        views[i] = front;
        views[i].position = front.focal_point +
                            std::cos(elevation) * (std::cos(azimuth) * out + std::sin(azimuth) * side) +
                            std::sin(elevation) * glm::length(out) * glm::normalize(front.up);
    }
    return views;
}

std::vector<View> measure_fidelity(const RayCaster &rays, const Model &model, int level, int width, int height,
                                   int threads) {
    const ReferenceRenderer renderer(model);
    Framebuffer picture(width, height);
    std::vector<View> views;
    for (const Camera &camera : eight_views(model, width, height)) {
        View view;
        view.drawn = renderer.render(camera, {.level = level}, picture);
        const double voxel = model.parameters.grid.voxel_size_at(view.drawn.level);
        view.figures = compare(rays.cast(camera, width, height, threads), picture, voxel);
        view.voxel_pixels =
            voxel * height / (2 * std::tan(camera.view_angle / 2)) / glm::length(camera.position - camera.focal_point);
        views.push_back(view);
    }
    return views;
}

namespace {

FidelityFigures total(const std::vector<View> &views) {
    FidelityFigures sum;
    for (const View &view : views)
        sum += view.figures;
    return sum;
}

std::string text_line(const char *name, const FidelityFigures &f) {
    std::array<char, 200> line{};
    std::snprintf(line.data(), line.size(), "%-5s %9llu %9llu %7llu %7llu %8.4f %8.3f %8.3f\n", name,
                  static_cast<unsigned long long>(f.object), static_cast<unsigned long long>(f.interior),
                  static_cast<unsigned long long>(f.holes), static_cast<unsigned long long>(f.see_through),
                  percent(f.bleed, f.object), percent(f.deep, f.interior), percent(f.deep_near, f.interior));
    return line.data();
}

std::string json_object(const FidelityFigures &f) {
    std::array<char, 300> line{};
    std::snprintf(line.data(), line.size(),
                  "{\"object\": %llu, \"interior\": %llu, \"holes\": %llu, \"see_through\": %llu, "
                  "\"bleed_percent\": %.5f, \"depth_percent\": %.4f, \"depth_near_percent\": %.4f}",
                  static_cast<unsigned long long>(f.object), static_cast<unsigned long long>(f.interior),
                  static_cast<unsigned long long>(f.holes), static_cast<unsigned long long>(f.see_through),
                  percent(f.bleed, f.object), percent(f.deep, f.interior), percent(f.deep_near, f.interior));
    return line.data();
}

} // namespace

std::string to_text(const std::vector<View> &views) {
    std::string text = "view     object  interior   holes through  bleed %  depth %   near %\n";
    for (std::size_t i = 0; i < views.size(); ++i)
        text += text_line(std::to_string(i).c_str(), views[i].figures);
    return text + text_line("all", total(views));
}

std::string to_json(const std::vector<View> &views) {
    std::string text = "{\"views\": [";
    for (std::size_t i = 0; i < views.size(); ++i)
        text += (i > 0 ? ", " : "") + json_object(views[i].figures);
    std::array<char, 100> size{};
    std::snprintf(size.data(), size.size(), "%d, \"voxel_pixels\": %.4f", views.empty() ? 0 : views[0].drawn.level,
                  views.empty() ? 0 : views[0].voxel_pixels);
    return text + "], \"all\": " + json_object(total(views)) + ", \"level\": " + size.data() + "}\n";
}

} // namespace pbm
