#include "pbm_render/fine/fine_renderer.h"

#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/bricks/drawn_runs.h"
#include "pbm_render/fine/fine_view.h"
#include "pbm_render/fine/pixel_sampler.h"
#include "pbm_render/fine/sample_sums.h"
#include "pbm_render/fine/splat_blender.h"
#include "pbm_render/surroundings/surroundings.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace pbm {
namespace {

// Pixels of a strip, so that its sums and depths fit the cache.
constexpr int kStripPixels = 32 * 1024;
constexpr int kMinStripRows = 16;

// Offset of sample `i` from the pixel's centre: 0 for the first one. The R2 sequence spreads any number of samples
// evenly.
// Based on: Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018
glm::dvec2 sample_offset(int i) {
    constexpr double kPlastic = 1.32471795724474602596;
    const auto fraction = [&](double step) { return std::fmod(0.5 + i * step, 1.0) - 0.5; };
    return {fraction(1 / kPlastic), fraction(1 / (kPlastic * kPlastic))};
}

// Memory of one thread.
struct ThreadScratch {
    explicit ThreadScratch(int width) : row(width) {}

    DepthStrip visible;
    FarthestDepths farthest; // of the fronts
    StripPoints fronts{false}, backs{true};
    SurfaceBuffer surface;
    SurfaceRow row;
    SurroundingsRow around;
    ChosenCounts chosen;
    SampledPixels pixels;
    std::vector<float> depths; // [width]
};

// Moves a strip whose pixels are not used.
void set_rows(DepthStrip &strip, int width, int top, int bottom) {
    strip.width = width;
    strip.top = top;
    strip.bottom = bottom;
}

// Samples that are added at once.
struct SampleGroup {
    SampleGroup(int first, int wanted) : count(std::min(wanted, static_cast<int>(SampledPixels::kSamples))) {
        for (std::size_t i = 0; i < SampledPixels::kSamples; ++i) {
            of[i] = sample_offset(first + std::min(static_cast<int>(i), count - 1));
            offsets.x[i] = static_cast<float>(of[i].x);
            offsets.y[i] = static_cast<float>(of[i].y);
        }
    }
    int count;
    std::array<glm::dvec2, SampledPixels::kSamples> of;
    SampledPixels::Offsets offsets;
};

} // namespace

struct FineRenderer::Frame {
    Frame(const ModelParameters &p, std::uint32_t chunk_points, std::shared_ptr<ThreadPool> threads,
          std::shared_ptr<const Surroundings> around)
        : parameters(p), surroundings(std::move(around)), appearance(p), runs(chunk_points), pool(std::move(threads)) {}

    int strip_rows() const { return std::max(kMinStripRows, kStripPixels / view->width); }
    void for_each_strip(const std::atomic<bool> *stop,
                        const std::function<void(int top, int bottom, ThreadScratch &)> &work);
    void add_first(const std::atomic<bool> *stop);
    std::uint64_t draw(int top, int bottom, ThreadScratch &at);
    void blend(ThreadScratch &at) const;
    void collect_row(int y, ThreadScratch &at) const;
    void add_first_row(int y, ThreadScratch &at);

    void choose_pixels();
    void add_group(const SampleGroup &group, const std::atomic<bool> *stop);
    void draw_group(const SampleGroup &group, int top, int bottom, ThreadScratch &at);
    void draw_pixels(const SampleGroup &group, ThreadScratch &at) const;
    void draw_near_pixels(const SampleGroup &group, ThreadScratch &at) const;
    void collect_samples(const SampleGroup &group, int y, std::size_t sample, ThreadScratch &at) const;
    void add_surroundings(int y, glm::dvec2 offset, ThreadScratch &at);

    Float4 behind_row(int y, const ColourTable &colours) const;
    void resolve_row(int y, std::span<const Float4> means, const ColourTable &colours, Framebuffer &target) const;

    const ModelParameters &parameters;
    const std::shared_ptr<const Surroundings> surroundings;
    Appearance appearance;
    DrawnRuns runs;
    const std::shared_ptr<ThreadPool> pool;

    std::optional<FineView> view;
    int samples = 0;
    RenderStatistics statistics{};
    std::vector<ThreadScratch> thread_scratch; // [thread]
    SampleSums sums;
    PixelArray<float> first_depth; // [height][width], of the first sample, grid edges
};

FineRenderer::FineRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, int threads,
                           std::shared_ptr<const Surroundings> surroundings)
    : FineRenderer(parameters, chunk_points, std::make_shared<ThreadPool>(resolve_threads(threads)),
                   std::move(surroundings)) {}

FineRenderer::FineRenderer(const ModelParameters &parameters, std::uint32_t chunk_points,
                           std::shared_ptr<ThreadPool> pool, std::shared_ptr<const Surroundings> surroundings)
    : frame_(std::make_unique<Frame>(parameters, chunk_points, std::move(pool), std::move(surroundings))) {}

FineRenderer::~FineRenderer() = default;

void FineRenderer::set_appearance(Appearance appearance) { frame_->appearance = std::move(appearance); }

RenderStatistics FineRenderer::render(std::span<const PointRun> runs, const Camera &camera,
                                      const RenderOptions &options, Framebuffer &target, int samples) {
    begin(runs, camera, options, target);
    const RenderStatistics statistics = add_samples(std::max(samples, 1));
    resolve(target);
    return statistics;
}

void FineRenderer::begin(std::span<const PointRun> runs, const Camera &camera, const RenderOptions &options,
                         const Framebuffer &target) {
    Frame &frame = *frame_;
    assert(std::all_of(runs.begin(), runs.end(), [](const PointRun &run) { return run.offsets != nullptr; }));
    frame.runs.set(runs);
    frame.view.emplace(frame.parameters, frame.appearance, frame.surroundings.get(), camera, options, target);
    frame.thread_scratch.clear();
    for (int i = 0; i < frame.pool->threads(); ++i)
        frame.thread_scratch.emplace_back(target.width);
    frame.sums.begin(target.width, target.height);
    frame.first_depth.resize(frame.view->with_depths ? target.pixels() : 0);
    frame.samples = 0;
    frame.statistics = frame.runs.statistics();
}

RenderStatistics FineRenderer::add_samples(int count, const std::atomic<bool> *stop) {
    Frame &frame = *frame_;
    const auto stopped = [stop] { return stop != nullptr && stop->load(std::memory_order_relaxed); };
    const int wanted = frame.samples + count;
    if (frame.samples == 0 && count > 0) {
        frame.add_first(stop);
        if (stopped())
            return {};
        frame.samples = 1;
    }
    if (frame.samples < wanted && !frame.sums.has_choice())
        frame.choose_pixels();
    while (frame.samples < wanted) {
        const SampleGroup group(frame.samples, wanted - frame.samples);
        frame.add_group(group, stop);
        if (stopped())
            return {};
        frame.samples += group.count;
    }
    return frame.statistics;
}

int FineRenderer::samples() const { return frame_->samples; }

void FineRenderer::resolve(Framebuffer &target) {
    const ColourTable colours;
    Frame &frame = *frame_;
    frame.for_each_strip(nullptr, [&](int top, int bottom, ThreadScratch &) {
        frame.sums.for_each_row(top, bottom, frame.samples, [&](int y, std::span<const Float4> means) {
            frame.resolve_row(y, means, colours, target);
        });
    });
}

void FineRenderer::resolve(std::span<Float4> target) const {
    const Frame &frame = *frame_;
    const ColourTable colours;
    frame.sums.for_each_row(0, frame.view->height, frame.samples, [&](int y, std::span<const Float4> means) {
        const Float4 behind = frame.behind_row(y, colours);
        std::transform(means.begin(), means.end(), target.begin() + std::ptrdiff_t{y} * frame.view->width,
                       [&](Float4 mean) { return mean + behind * (1 - mean[3]); });
    });
}

// Runs `work` for all strips of the picture, unless it is stopped.
void FineRenderer::Frame::for_each_strip(const std::atomic<bool> *stop,
                                         const std::function<void(int top, int bottom, ThreadScratch &)> &work) {
    const int rows = strip_rows();
    pool->run(static_cast<std::size_t>((view->height + rows - 1) / rows), [&](std::size_t i, std::size_t thread) {
        const int top = static_cast<int>(i) * rows;
        if (stop == nullptr || !stop->load(std::memory_order_relaxed))
            work(top, std::min(top + rows, view->height), thread_scratch[thread]);
    });
}

// Adds the sample at the centres of all pixels.
void FineRenderer::Frame::add_first(const std::atomic<bool> *stop) {
    runs.begin_view(view->geometry);
    pool->run(runs.size(), [&](std::size_t run, std::size_t) {
        if (stop != nullptr && stop->load(std::memory_order_relaxed))
            return;
        runs.cull(run, view->geometry, [&](const RunGeometry &of, std::span<VisibleBrick> seen) {
            make_bricks_soft(view->geometry, of, seen);
        });
        runs.estimate_offsets(run);
    });
    std::atomic<std::uint64_t> drawn = 0;
    for_each_strip(stop, [&](int top, int bottom, ThreadScratch &at) { drawn += draw(top, bottom, at); });
    statistics.drawn_points = drawn;
}

// Adds the first sample to the rows of a strip. Returns the number of points drawn.
std::uint64_t FineRenderer::Frame::draw(int top, int bottom, ThreadScratch &at) {
    const FrameGeometry &geometry = view->geometry;
    at.visible.begin(view->width, top, bottom);
    at.fronts.clear();
    at.backs.clear();
    std::uint64_t drawn = 0;
    runs.for_each_in_rows(top, bottom,
                          [&](const RunGeometry &run, std::span<const VisibleBrick> seen, std::uint32_t first_id) {
                              drawn += draw_fronts(geometry, run, seen, first_id, at.visible, at.fronts, at.backs);
                          });
    if (geometry.shows_backs) {
        at.farthest.begin(at.visible);
        runs.for_each_in_rows(top, bottom,
                              [&](const RunGeometry &run, std::span<const VisibleBrick> seen, std::uint32_t first_id) {
                                  drawn += add_backs(geometry, run, seen, first_id, at.visible, at.farthest, at.backs);
                              });
        draw_and_keep_visible(geometry, at.backs, at.farthest, at.visible);
    }
    blend(at);
    for (int y = top; y < bottom; ++y) {
        collect_row(y, at);
        view->shade(y, view->rays(), at.row);
        add_first_row(y, at);
    }
    return drawn;
}

// Blends fronts where fronts are visible, and backs where backs are.
void FineRenderer::Frame::blend(ThreadScratch &at) const {
    at.surface.begin(at.visible, view->points.groups(), !at.backs.empty());
    blend_points(view->geometry, at.visible, at.fronts, view->points, at.surface);
    if (!at.surface.shows_backs())
        return;
    at.surface.swap_sides();
    blend_points(view->geometry, at.visible, at.backs, view->points, at.surface);
    at.surface.join_sides();
}

// Collects the blended surface of a row's pixels for shading.
void FineRenderer::Frame::collect_row(int y, ThreadScratch &at) const {
    const SurfaceBuffer &surface = at.surface;
    const float *const depths = surface.depth.data() + surface.offset(0, y);
    at.row.count = 0;
    for (int x = 0; x < surface.width; ++x)
        if (depths[x] < std::numeric_limits<float>::infinity())
            view->collect(
                {x, y, depths[x], surface.sums_of(surface.offset(x, y))->channels.data(), at.visible.id(x, y)},
                view->rays(), runs, at.row);
}

void FineRenderer::Frame::add_first_row(int y, ThreadScratch &at) {
    const SurfaceRow &row = at.row;
    const auto width = static_cast<std::size_t>(view->width);
    const std::span<Float4> to = sums.row(y);
    std::fill(to.begin(), to.end(), Float4{});
    const float *const depths = at.surface.depth.data() + at.surface.offset(0, y);
    const auto opaque = [&](std::size_t i) { return Float4{row.colour[0][i], row.colour[1][i], row.colour[2][i], 1}; };
    float *const depths_to = view->with_depths ? first_depth.data() + static_cast<std::size_t>(y) * width : nullptr;
    if (depths_to != nullptr)
        std::copy_n(depths, width, depths_to);
    for (std::size_t i = 0; i < row.count; ++i)
        to[static_cast<std::size_t>(row.x[i])] = opaque(i);
    if (view->around.is_plain())
        return;
    SurroundingsRow &around = at.around;
    view->around.look(glm::dvec2(0.5, y + 0.5), width, depths, around);
    for (std::size_t x = 0; x < width; ++x)
        if (to[x][3] == 0 || around.coverage[x] > 0)
            to[x] = Float4{around.red[x], around.green[x], around.blue[x], 1} * around.alpha[x];
    if (depths_to != nullptr)
        for (std::size_t x = 0; x < width; ++x)
            if (around.coverage[x] >= 0.5F)
                depths_to[x] = around.depth[x];
}

// Chooses the pixels that get more samples.
void FineRenderer::Frame::choose_pixels() {
    const ColourTable colours;
    sums.begin_choice(view->around.has_reflections()); // mirrors need the normals beside a pixel
    for_each_strip(nullptr, [&](int top, int bottom, ThreadScratch &at) {
        at.surface = {};
        sums.choose(top, bottom, [&](int y) { return behind_row(y, colours); });
    });
}

// Adds several samples to the chosen pixels.
void FineRenderer::Frame::add_group(const SampleGroup &group, const std::atomic<bool> *stop) {
    for_each_strip(stop, [&](int top, int bottom, ThreadScratch &at) { draw_group(group, top, bottom, at); });
}

void FineRenderer::Frame::draw_group(const SampleGroup &group, int top, int bottom, ThreadScratch &at) {
    at.chosen.begin(sums.chosen(), view->width, top, bottom);
    at.fronts.clear();
    at.backs.clear();
    set_rows(at.visible, view->width, top, bottom);
    runs.for_each_in_rows(
        top - 1, bottom + 1, [&](const RunGeometry &run, std::span<const VisibleBrick> seen, std::uint32_t first_id) {
            find_points(view->geometry, run, seen, first_id, at.visible, at.chosen, at.fronts, at.backs);
        });
    for (int row = top; row < bottom; row = at.pixels.bottom) {
        at.pixels.begin(at.chosen, row, view->points.groups());
        if (at.pixels.count == 0)
            continue;
        set_rows(at.visible, view->width, row, at.pixels.bottom);
        draw_pixels(group, at);
        for (int y = row; y < at.pixels.bottom; ++y)
            for (std::size_t sample = 0; sample < static_cast<std::size_t>(group.count); ++sample) {
                collect_samples(group, y, sample, at);
                view->shade(y, view->rays(group.of[sample]), at.row);
                const std::span<Float4> to = sums.row(y);
                if (!view->around.is_plain()) {
                    add_surroundings(y, group.of[sample], at);
                    continue;
                }
                for (std::size_t i = 0; i < at.row.count; ++i)
                    to[static_cast<std::size_t>(at.row.x[i])] +=
                        Float4{at.row.colour[0][i], at.row.colour[1][i], at.row.colour[2][i], 1};
            }
    }
}

// Draws and blends the points of a strip into its chosen pixels.
void FineRenderer::Frame::draw_pixels(const SampleGroup &group, ThreadScratch &at) const {
    const FrameGeometry &geometry = view->geometry;
    SampledPixels &pixels = at.pixels;
    draw_samples(geometry, at.visible, at.fronts, group.offsets, nullptr, pixels);
    if (!at.backs.empty()) {
        pixels.find_hiding_depths();
        draw_samples(geometry, at.visible, at.backs, group.offsets, pixels.farthest_front.data(), pixels);
    }
    draw_near_pixels(group, at);
    const bool any_back = pixels.split_sides();
    blend_samples(geometry, at.visible, at.fronts, view->points, group.offsets,
                  {pixels.depth.data(), pixels.farthest_front.data()}, pixels);
    if (any_back)
        blend_samples(geometry, at.visible, at.backs, view->points, group.offsets,
                      {pixels.back_depth.data(), pixels.farthest_back.data()}, pixels);
}

// Draws the splats around the eye.
void FineRenderer::Frame::draw_near_pixels(const SampleGroup &group, ThreadScratch &at) const {
    const auto has_near = [](const auto &block) { return !block->points.near.empty(); };
    const auto any_near = [&](const StripPoints &points) {
        return std::any_of(points.blocks().begin(), points.blocks().end(), has_near);
    };
    if (!any_near(at.fronts) && !any_near(at.backs))
        return;
    FrameGeometry geometry = view->geometry;
    for (std::size_t sample = 0; sample < static_cast<std::size_t>(group.count); ++sample) {
        const EyeRays rays = view->rays(group.of[sample]);
        geometry.middle_x = rays.middle_x;
        geometry.middle_y = rays.middle_y;
        at.visible.begin(view->width, at.pixels.top, at.pixels.bottom);
        for (const StripPoints *points : {&at.fronts, &at.backs})
            for (const auto &block : points->blocks())
                draw_near(block->points.near, geometry, at.visible);
        at.pixels.for_each_in_box(
            0, view->width, at.pixels.top, at.pixels.bottom, [&](int x, int y, std::size_t pixel) {
                double &to = at.pixels.visible[pixel * SampledPixels::kSamples + sample];
                to = std::min(to, at.visible.pixels[static_cast<std::size_t>(at.visible.offset(x, y))]);
            });
    }
}

// Collects a sample of a row's chosen pixels for shading.
void FineRenderer::Frame::collect_samples(const SampleGroup &group, int y, std::size_t sample,
                                          ThreadScratch &at) const {
    const SampledPixels &pixels = at.pixels;
    const std::size_t channels = pixels.groups * kGroupChannels;
    const EyeRays rays = view->rays(group.of[sample]);
    std::array<float, kMaxGroups * kGroupChannels> sums_of_pixel;
    at.row.count = 0;
    pixels.for_each_in_box(0, view->width, y, y + 1, [&](int x, int, std::size_t pixel) {
        const std::size_t i = pixel * SampledPixels::kSamples + sample;
        const float depth = std::min(pixels.depth[i], pixels.back_depth[i]);
        if (depth == std::numeric_limits<float>::infinity())
            return;
        for (std::size_t channel = 0; channel < channels; ++channel)
            sums_of_pixel[channel] = pixels.sums[pixel * channels + channel].channels[sample];
        view->collect({x, y, depth, sums_of_pixel.data(), DepthStrip::id_of(pixels.visible[i])}, rays, runs, at.row);
    });
}

// Adds a sample of a row's chosen pixels, which ground and panorama may be seen in.
void FineRenderer::Frame::add_surroundings(int y, glm::dvec2 offset, ThreadScratch &at) {
    const SurfaceRow &row = at.row;
    const std::span<Float4> to = sums.row(y);
    const auto width = static_cast<std::size_t>(view->width);
    at.depths.assign(width, 0); // behind other pixels nothing is looked for
    for_each_bit(sums.chosen().row(y),
                 [&](int x) { at.depths[static_cast<std::size_t>(x)] = std::numeric_limits<float>::infinity(); });
    for (std::size_t i = 0; i < row.count; ++i)
        at.depths[static_cast<std::size_t>(row.x[i])] = row.depth[i];
    view->around.look(glm::dvec2(0.5, y + 0.5) + offset, width, at.depths.data(), at.around);
    const SurroundingsRow &around = at.around;
    std::size_t i = 0;
    for_each_bit(sums.chosen().row(y), [&](int column) {
        const auto x = static_cast<std::size_t>(column);
        const bool is_object = i < row.count && row.x[i] == column;
        if (is_object && around.coverage[x] <= 0)
            to[x] += Float4{row.colour[0][i], row.colour[1][i], row.colour[2][i], 1};
        else
            to[x] += Float4{around.red[x], around.green[x], around.blue[x], 1} * around.alpha[x];
        i += is_object;
    });
}

// What a sample that meets nothing adds to sums of light: the background, where it is plain.
Float4 FineRenderer::Frame::behind_row(int y, const ColourTable &colours) const {
    if (!view->around.is_plain())
        return Float4{};
    const Rgba8 background = background_at(view->options, (y + 0.5) / view->height);
    return (colours.linear(pack_rgba(background)) + Float4{0, 0, 0, 1}) * (static_cast<float>(background[3]) / 255);
}

void FineRenderer::Frame::resolve_row(int y, std::span<const Float4> means, const ColourTable &colours,
                                      Framebuffer &target) const {
    const auto width = static_cast<std::size_t>(view->width);
    const std::size_t start = static_cast<std::size_t>(y) * width;
    const std::uint32_t background = pack_rgba(background_at(view->options, (y + 0.5) / view->height));
    const Float4 behind = behind_row(y, colours);
    for (std::size_t x = 0; x < width; ++x) {
        const Float4 mean = means[x];
        if (mean[3] <= 0) {
            target.colour[start + x] = background;
            continue;
        }
        const float missing = view->around.is_plain() ? 1 - mean[3] : 0;
        const Float4 all = mean + behind * missing;
        const std::uint32_t rgb = colours.pack_srgb(all / all[3]) & 0xFFFFFF;
        const auto alpha = static_cast<std::uint32_t>(std::min(all[3], 1.0F) * 255 + 0.5F);
        target.colour[start + x] = rgb | alpha << 24;
    }
    if (target.depth.empty() || !view->with_depths)
        return;
    const auto edge = static_cast<float>(parameters.grid.edge());
    std::transform(first_depth.begin() + static_cast<std::ptrdiff_t>(start),
                   first_depth.begin() + static_cast<std::ptrdiff_t>(start + width),
                   target.depth.begin() + static_cast<std::ptrdiff_t>(start), [&](float z) { return z * edge; });
}

} // namespace pbm
