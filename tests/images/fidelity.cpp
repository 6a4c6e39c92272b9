#include "fidelity.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

namespace pbm {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();

struct DepthRange {
    float nearest = kEmpty, farthest = -kEmpty;
};

// Minimum and maximum of the (2 * reach + 1)^2 pixels around (x, y). Pixels beyond the border are empty.
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

std::uint64_t squared_difference(const Srgb &truth, std::uint32_t drawn) {
    const Rgba8 colour = unpack_rgba(drawn);
    int sum = 0;
    for (std::size_t channel = 0; channel < 3; ++channel)
        sum += (truth[channel] - colour[channel]) * (truth[channel] - colour[channel]);
    return static_cast<std::uint64_t>(sum);
}

} // namespace

FidelityFigures &FidelityFigures::operator+=(const FidelityFigures &o) {
    object += o.object;
    interior += o.interior;
    holes += o.holes;
    see_through += o.see_through;
    bleed += o.bleed;
    shrunk += o.shrunk;
    deep += o.deep;
    deep_near += o.deep_near;
    on_surface += o.on_surface;
    squared_error += o.squared_error;
    return *this;
}

std::vector<float> outside_depths(const RayImage &image) {
    std::vector<float> outside = image.depths;
    for (std::size_t i = 0; i < outside.size(); ++i)
        outside[i] = image.inside[i] != 0 ? kEmpty : outside[i];
    return outside;
}

bool is_interior(const std::vector<float> &outside, const Framebuffer &picture, std::size_t at) {
    const int x = static_cast<int>(at % static_cast<std::size_t>(picture.width));
    const int y = static_cast<int>(at / static_cast<std::size_t>(picture.width));
    return range_around(outside, picture.width, picture.height, x, y, 2).farthest != kEmpty;
}

FidelityFigures compare(const RayImage &image, std::span<const Srgb> truth, const Drawing &drawing) {
    const Framebuffer &drawn = drawing.picture;
    const std::vector<float> &rays = image.depths;
    const std::vector<float> outside = outside_depths(image);
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
            figures.shrunk +=
                depth == kEmpty && range_around(outside, drawn.width, drawn.height, x, y, 1).farthest != kEmpty;
            const DepthRange around = range_around(outside, drawn.width, drawn.height, x, y, 2);
            if (around.farthest == kEmpty)
                continue;
            ++figures.interior;
            if (!truth.empty())
                figures.squared_error += squared_difference(truth[at], drawn.colour[at]);
            if (depth == kEmpty) {
                ++figures.holes;
                continue;
            }
            const float voxel = drawing.voxels[at];
            const DepthRange next = range_around(rays, drawn.width, drawn.height, x, y, 1);
            figures.see_through += depth > around.farthest + kSeeThroughVoxels * voxel;
            figures.deep += std::abs(depth - rays[at]) <= voxel;
            figures.on_surface += std::abs(depth - rays[at]) * image.cosines[at] <= voxel;
            figures.deep_near += depth >= next.nearest - voxel && depth <= next.farthest + voxel;
        }
    }
    return figures;
}

double psnr(const FidelityFigures &figures) {
    return 10 * std::log10(3 * 255.0 * 255.0 * static_cast<double>(figures.interior) /
                           static_cast<double>(figures.squared_error));
}

Draw draw_level(const ReferenceRenderer &renderer, const Grid &grid, int level) {
    return [&renderer, &grid, level](const Camera &camera, Drawing &drawing) {
        drawing.drawn = renderer.render(camera, {}, drawing.picture, {.level = level});
        drawing.voxels.assign(drawing.voxels.size(), static_cast<float>(grid.voxel_size_at(drawing.drawn.level)));
    };
}

namespace {

// Writes for each pixel the voxel edge of its level: the level which gives the same depth when drawn alone. Empty
// pixels get that of the finest level.
void find_voxels(std::span<const PointRun> runs, FastRenderer &renderer, const Grid &grid, const Camera &camera,
                 const Framebuffer &picture, std::vector<float> &voxels) {
    int finest = 1;
    for (const PointRun &run : runs)
        finest = std::max(finest, run.level);
    voxels.assign(voxels.size(), static_cast<float>(grid.voxel_size_at(finest)));
    Framebuffer alone(picture.width, picture.height);
    for (int level = 1; level < finest; ++level) {
        std::vector<PointRun> some(runs.begin(), runs.end());
        std::erase_if(some, [&](const PointRun &run) { return run.level != level; });
        if (some.empty())
            continue;
        renderer.render(some, camera, {}, alone);
        for (std::size_t i = 0; i < voxels.size(); ++i)
            if (alone.depth[i] == picture.depth[i] && picture.depth[i] != kEmpty)
                voxels[i] = static_cast<float>(grid.voxel_size_at(level));
    }
}

} // namespace

Draw draw_detail(StreamedModel &model, FastRenderer &fast, double max_error, int finest, const RenderOptions &options,
                 FineRenderer *fine, const std::function<void(std::span<PointRun>)> &change) {
    return [&model, &fast, max_error, finest, options, fine, change](const Camera &camera, Drawing &drawing) {
        Framebuffer &picture = drawing.picture;
        Result<Detail> detail = model.load({camera, picture.width, picture.height, max_error, finest});
        if (!detail)
            throw std::runtime_error(detail.error().message);
        if (change)
            change(detail->runs);
        drawing.drawn = fast.render(detail->runs, camera, options, picture);
        find_voxels(detail->runs, fast, model.reader().parameters().grid, camera, picture, drawing.voxels);
        if (fine != nullptr)
            drawing.drawn = fine->render(detail->runs, camera, options, picture);
    };
}

std::array<Camera, 8> eight_views(const Sphere &bounds, UpAxis up, int width, int height) {
    const Camera front = camera_around(bounds, up, width, height);
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

std::vector<View> measure_fidelity(const RayCaster &rays, const Draw &draw, std::span<const Camera> cameras, int width,
                                   int height, int threads) {
    Drawing drawing(width, height);
    std::vector<View> views;
    for (const Camera &camera : cameras) {
        draw(camera, drawing);
        views.push_back({.drawn = drawing.drawn,
                         .figures = compare(rays.cast(camera, width, height, threads), {}, drawing),
                         .pixels_per_unit = height / (2 * std::tan(camera.view_angle / 2)) /
                                            glm::length(camera.position - camera.focal_point)});
    }
    return views;
}

FidelityFigures total(const std::vector<View> &views) {
    FidelityFigures sum;
    for (const View &view : views)
        sum += view.figures;
    return sum;
}

double percent(std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

namespace {

std::string text_line(const char *name, const FidelityFigures &f) {
    std::array<char, 200> line{};
    std::snprintf(line.data(), line.size(), "%-5s %9llu %9llu %7llu %7llu %8.4f %8.4f %8.3f %8.3f %9.3f\n", name,
                  static_cast<unsigned long long>(f.object), static_cast<unsigned long long>(f.interior),
                  static_cast<unsigned long long>(f.holes), static_cast<unsigned long long>(f.see_through),
                  percent(f.bleed, f.object), percent(f.shrunk, f.object), percent(f.deep, f.interior),
                  percent(f.deep_near, f.interior), percent(f.on_surface, f.interior));
    return line.data();
}

} // namespace

std::string to_text(const std::vector<View> &views) {
    std::string text = "view     object  interior   holes through  bleed % shrunk %  depth %   near % surface %\n";
    for (std::size_t i = 0; i < views.size(); ++i)
        text += text_line(std::to_string(i).c_str(), views[i].figures);
    return text + text_line("all", total(views));
}

} // namespace pbm
