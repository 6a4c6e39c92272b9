#include "fidelity.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

namespace pbm {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();

// Combines the (2 * reach + 1)^2 values around each pixel, rows first.
template <class Choose>
std::vector<float> around(const std::vector<float> &values, std::size_t width, std::size_t reach, Choose choose) {
    const std::size_t height = values.size() / width, wide = width + 2 * reach;
    std::vector<float> rows((height + 2 * reach) * wide, kEmpty), result(values.size());
    std::vector<float> row(wide, kEmpty);
    for (std::size_t y = 0; y < height; ++y) {
        std::copy_n(values.data() + y * width, width, row.data() + reach);
        float *const to = rows.data() + (y + reach) * wide;
        for (std::size_t x = 0; x < width; ++x)
            to[x] = row[x];
        for (std::size_t by = 1; by <= 2 * reach; ++by)
            for (std::size_t x = 0; x < width; ++x)
                to[x] = choose(to[x], row[x + by]);
    }
    for (std::size_t y = 0; y < height; ++y) {
        float *const to = result.data() + y * width;
        std::copy_n(rows.data() + y * wide, width, to);
        for (std::size_t by = 1; by <= 2 * reach; ++by)
            for (std::size_t x = 0; x < width; ++x)
                to[x] = choose(to[x], rows[(y + by) * wide + x]);
    }
    return result;
}

} // namespace

std::uint64_t squared_difference(const Srgb &truth, std::uint32_t drawn) {
    const Rgba8 colour = unpack_rgba(drawn);
    int sum = 0;
    for (std::size_t channel = 0; channel < 3; ++channel)
        sum += (truth[channel] - colour[channel]) * (truth[channel] - colour[channel]);
    return static_cast<std::uint64_t>(sum);
}

double decibels(std::uint64_t pixels, std::uint64_t squared_error) {
    return 10 * std::log10(3 * 255.0 * 255.0 * static_cast<double>(pixels) / static_cast<double>(squared_error));
}

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
    seen += o.seen;
    seen_error += o.seen_error;
    return *this;
}

PictureTruth::PictureTruth(RayImage image, int picture_width, bool shows_backs)
    : rays(std::move(image)), outside(rays.depths) {
    const auto lesser = [](float a, float b) { return std::min(a, b); };
    const auto greater = [](float a, float b) { return std::max(a, b); };
    const auto width = static_cast<std::size_t>(picture_width);
    for (std::size_t i = 0; i < outside.size(); ++i)
        outside[i] = rays.inside[i] != 0 && !shows_backs ? kEmpty : outside[i];
    nearest = around(rays.depths, width, 1, lesser);
    farthest = around(rays.depths, width, 1, greater);
    farthest_outside_1 = around(outside, width, 1, greater);
    farthest_outside_2 = around(outside, width, 2, greater);
}

FidelityFigures compare(const PictureTruth &truth, std::span<const Srgb> colours, const DrawnPicture &drawing) {
    const Framebuffer &drawn = drawing.picture;
    const Rgba8 background = RenderOptions{}.background;
    const std::uint32_t nothing = pack_rgba(background) & 0xFFFFFF;
    FidelityFigures figures;
    for (std::size_t at = 0; at < drawn.pixels(); ++at) {
        if (!colours.empty() && (pack_rgb(colours[at]) != nothing || (drawn.colour[at] & 0xFFFFFF) != nothing)) {
            ++figures.seen;
            figures.seen_error += squared_difference(colours[at], drawn.colour[at]);
        }
        const float depth = drawn.depth[at], ray = truth.rays.depths[at];
        if (ray == kEmpty) {
            figures.bleed += depth != kEmpty && truth.nearest[at] == kEmpty;
            continue;
        }
        ++figures.object;
        figures.shrunk += depth == kEmpty && truth.farthest_outside_1[at] != kEmpty;
        if (!truth.is_interior(at))
            continue;
        ++figures.interior;
        if (!colours.empty())
            figures.squared_error += squared_difference(colours[at], drawn.colour[at]);
        if (depth == kEmpty) {
            ++figures.holes;
            continue;
        }
        const float voxel = drawing.voxels[at];
        figures.see_through += depth > truth.farthest_outside_2[at] + kSeeThroughVoxels * voxel;
        figures.deep += std::abs(depth - ray) <= voxel;
        figures.on_surface += std::abs(depth - ray) * truth.rays.cosines[at] <= voxel;
        figures.deep_near += depth >= truth.nearest[at] - voxel && depth <= truth.farthest[at] + voxel;
    }
    return figures;
}

double psnr(const FidelityFigures &figures) { return decibels(figures.interior, figures.squared_error); }
double psnr_seen(const FidelityFigures &figures) { return decibels(figures.seen, figures.seen_error); }

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
    return [&model, &fast, max_error, finest, options, fine, change](const Camera &camera, DrawnPicture &drawing) {
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

std::array<Camera, 8> eight_views(const Sphere &bounds, UpAxis up, int width, int height, bool all_round) {
    const Camera front = camera_around(bounds, up, width, height);
    const glm::dvec3 out = front.position - front.focal_point;
    const glm::dvec3 side = glm::cross(glm::normalize(front.up), out);
    std::array<Camera, 8> views;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const double azimuth =
            glm::radians(i < 4 ? 90.0 * static_cast<double>(i) : 90.0 * static_cast<double>(i) - 315);
        const double raised = all_round && i % 2 == 1 ? -35 : 35;
        const double elevation = glm::radians(i < 4 ? 0.0 : raised);
        views[i] = front;
        views[i].position = front.focal_point +
                            std::cos(elevation) * (std::cos(azimuth) * out + std::sin(azimuth) * side) +
                            std::sin(elevation) * glm::length(out) * glm::normalize(front.up);
    }
    return views;
}

std::vector<View> measure_fidelity(std::span<const PictureTruth> truths, const Draw &draw,
                                   std::span<const Camera> cameras, int width, int height) {
    DrawnPicture drawing(width, height);
    std::vector<View> views;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const Camera &camera = cameras[i];
        draw(camera, drawing);
        views.push_back({.drawn = drawing.drawn,
                         .figures = compare(truths[i], {}, drawing),
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
