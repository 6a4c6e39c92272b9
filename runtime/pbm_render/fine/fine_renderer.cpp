#include "pbm_render/fine/fine_renderer.h"

#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/bricks/drawn_runs.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/fine/splat_blender.h"
#include "pbm_render/fine/surface_points.h"
#include "pbm_render/shading/surface_shader.h"
#include "pbm_render/surroundings/surroundings.h"
#include "pbm_render/surroundings/surroundings_view.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

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
};

// Values that all strips of a sample share.
struct Sample {
    glm::dvec2 offset;
    const FrameGeometry &geometry;
};

// Values that all samples of a picture share.
struct Picture {
    Picture(const ModelParameters &parameters, const Appearance &look, const Surroundings *surroundings,
            const Camera &camera, const RenderOptions &asked, const Framebuffer &target)
        : width(target.width), height(target.height), with_depths(!target.depth.empty()), options(asked),
          projection(in_unit_grid(camera, parameters), target.width, target.height),
          appearance(appearance_in_frame(parameters, options, projection.axes, look)),
          points(parameters, appearance, options), around(surroundings, appearance, projection, options),
          lights(lights_in_eye_space(appearance.lights, parameters.grid.edge(), projection)) {}

    const int width, height;
    const bool with_depths;
    const RenderOptions options;
    const Projection projection;
    const Appearance appearance;
    const SurfacePoints points;
    const SurroundingsView around;
    const std::vector<EyeLight> lights;
    int samples = 0;
    RenderStatistics statistics{};
};

} // namespace

struct FineRenderer::Frame {
    Frame(const ModelParameters &p, std::uint32_t chunk_points, std::shared_ptr<ThreadPool> threads,
          std::shared_ptr<const Surroundings> around)
        : parameters(p), surroundings(std::move(around)), appearance(p), runs(chunk_points), pool(std::move(threads)) {}

    std::uint64_t draw(int top, int rows, const Sample &sample, ThreadScratch &at);
    void blend(const FrameGeometry &geometry, ThreadScratch &at) const;
    void collect_row(int y, const Sample &sample, ThreadScratch &at) const;
    void read_visible_point(std::uint32_t id, const Sample &sample, glm::vec2 pixel, SurfacePoint &to) const;
    void mirror(const Sample &sample, float screen_y, SurfaceRow &row) const;
    void add_row(int y, const Sample &sample, ThreadScratch &at);
    Float4 behind_row(int y, const ColourTable &colours) const;
    void resolve_row(int y, const ColourTable &colours, Framebuffer &target) const;

    const ModelParameters &parameters;
    const std::shared_ptr<const Surroundings> surroundings;
    Appearance appearance;
    DrawnRuns runs;
    const std::shared_ptr<ThreadPool> pool;

    std::optional<Picture> picture;
    std::vector<ThreadScratch> thread_scratch; // [thread]
    // [height][width]: sums over samples of light x alpha, and of alpha. resolve() adds a plain background.
    PixelArray<Float4> sum_of_light;
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
    RenderStatistics statistics;
    for (int i = 0; i < std::max(samples, 1); ++i)
        statistics = add_sample();
    resolve(target);
    return statistics;
}

void FineRenderer::begin(std::span<const PointRun> runs, const Camera &camera, const RenderOptions &options,
                         const Framebuffer &target) {
    Frame &frame = *frame_;
    assert(std::all_of(runs.begin(), runs.end(), [](const PointRun &run) { return run.offsets != nullptr; }));
    frame.runs.set(runs);
    frame.picture.emplace(frame.parameters, frame.appearance, frame.surroundings.get(), camera, options, target);
    frame.thread_scratch.clear();
    for (int i = 0; i < frame.pool->threads(); ++i)
        frame.thread_scratch.emplace_back(target.width);
    frame.sum_of_light.resize(target.pixels());
    frame.first_depth.resize(frame.picture->with_depths ? target.pixels() : 0);
    frame.picture->statistics = frame.runs.statistics();
}

RenderStatistics FineRenderer::add_sample(const std::atomic<bool> *stop) {
    const auto stopped = [stop] { return stop != nullptr && stop->load(std::memory_order_relaxed); };
    Frame &frame = *frame_;
    Picture &picture = *frame.picture;
    const glm::dvec2 offset = sample_offset(picture.samples);
    Projection projection = picture.projection;
    projection.middle -= offset;
    const FrameGeometry geometry(projection, picture.width, picture.height);
    const Sample sample{offset, geometry};
    frame.runs.begin_view(geometry);
    frame.pool->run(frame.runs.size(), [&](std::size_t run, std::size_t) {
        if (stopped())
            return;
        frame.runs.cull(run, geometry, [&](const RunGeometry &of, std::span<VisibleBrick> seen) {
            make_bricks_soft(geometry, of, seen);
        });
        frame.runs.estimate_offsets(run);
    });
    if (stopped())
        return {};

    const int rows = std::max(kMinStripRows, kStripPixels / picture.width);
    const auto count = static_cast<std::size_t>((picture.height + rows - 1) / rows);
    std::vector<std::uint64_t> drawn(count);
    frame.pool->run(count, [&](std::size_t i, std::size_t thread) {
        if (!stopped())
            drawn[i] = frame.draw(static_cast<int>(i) * rows, rows, sample, frame.thread_scratch[thread]);
    });
    picture.statistics.drawn_points = 0;
    for (const std::uint64_t points : drawn)
        picture.statistics.drawn_points += points;
    ++picture.samples;
    return picture.statistics;
}

int FineRenderer::samples() const { return frame_->picture ? frame_->picture->samples : 0; }

void FineRenderer::resolve(Framebuffer &target) {
    const ColourTable colours;
    frame_->pool->run(static_cast<std::size_t>(target.height),
                      [&](std::size_t y, std::size_t) { frame_->resolve_row(static_cast<int>(y), colours, target); });
}

void FineRenderer::resolve(std::span<Float4> target) const {
    const Frame &frame = *frame_;
    const ColourTable colours;
    const auto width = static_cast<std::size_t>(frame.picture->width);
    const auto samples = static_cast<float>(frame.picture->samples);
    for (int y = 0; y < frame.picture->height; ++y) {
        const Float4 behind = frame.behind_row(y, colours);
        const std::size_t start = static_cast<std::size_t>(y) * width;
        for (std::size_t i = start; i < start + width; ++i) {
            const Float4 sum = frame.sum_of_light[i];
            target[i] = (sum + behind * (samples - sum[3])) / samples;
        }
    }
}

// Adds a sample to `rows` rows from row `top` on. Returns the number of points drawn.
std::uint64_t FineRenderer::Frame::draw(int top, int rows, const Sample &sample, ThreadScratch &at) {
    at.visible.begin(picture->width, top, std::min(top + rows, picture->height));
    const FrameGeometry &geometry = sample.geometry;
    at.fronts.clear();
    at.backs.clear();
    std::uint64_t drawn = 0;
    runs.for_each_in_rows(top, at.visible.bottom,
                          [&](const RunGeometry &run, std::span<const VisibleBrick> seen, std::uint32_t first_id) {
                              drawn += draw_fronts(geometry, run, seen, first_id, at.visible, at.fronts, at.backs);
                          });
    if (geometry.shows_backs) {
        at.farthest.begin(at.visible);
        runs.for_each_in_rows(top, at.visible.bottom,
                              [&](const RunGeometry &run, std::span<const VisibleBrick> seen, std::uint32_t first_id) {
                                  drawn += add_backs(geometry, run, seen, first_id, at.visible, at.farthest, at.backs);
                              });
        draw_and_keep_visible(geometry, at.backs, at.farthest, at.visible);
    }
    blend(geometry, at);
    const EyeRays rays{sample.geometry.middle_x, sample.geometry.middle_y, sample.geometry.inverse_focal};
    for (int y = at.visible.top; y < at.visible.bottom; ++y) {
        collect_row(y, sample, at);
        const float screen_y = static_cast<float>(y) + 0.5F;
        shade_row(rays, picture->lights, picture->points.shadowed(), screen_y, at.row);
        if (picture->around.has_reflections())
            mirror(sample, screen_y, at.row);
        add_row(y, sample, at);
    }
    return drawn;
}

// Blends fronts where fronts are visible, and backs where backs are.
void FineRenderer::Frame::blend(const FrameGeometry &geometry, ThreadScratch &at) const {
    at.surface.begin(at.visible, picture->points.groups(), !at.backs.empty());
    blend_points(geometry, at.visible, at.fronts, picture->points, at.surface);
    if (!at.surface.shows_backs())
        return;
    at.surface.swap_sides();
    blend_points(geometry, at.visible, at.backs, picture->points, at.surface);
    at.surface.join_sides();
}

// Reads the visible point of a pixel that has no usable sums.
void FineRenderer::Frame::read_visible_point(std::uint32_t id, const Sample &sample, glm::vec2 pixel,
                                             SurfacePoint &to) const {
    const PointRun &run = runs[runs.ids().run(id)];
    const std::size_t i = runs.ids().point(id);
    const FrameGeometry &geometry = sample.geometry;
    const std::uint16_t stored = run.chunk->normals[i];
    const EyeNormal &n = geometry.normals[static_cast<std::size_t>(stored & geometry.normal_mask)];
    const float facing = n.x * (pixel.x - geometry.middle_x) * geometry.inverse_focal +
                         n.y * (pixel.y - geometry.middle_y) * geometry.inverse_focal + n.z;
    const bool turn = PointIds::is_back(id) || ((stored & kTwoSidedBit) != 0 && facing > 0);
    const float sign = turn ? -1.0F : 1.0F;
    to.channels[channel::kNormal] = sign * n.x;
    to.channels[channel::kNormal + 1] = sign * n.y;
    to.channels[channel::kNormal + 2] = sign * n.z;
    to.channels[channel::kWeight] = 1;
    picture->points.read(run, i, to);
}

// Collects the blended surface of a row's pixels for shading.
void FineRenderer::Frame::collect_row(int y, const Sample &sample, ThreadScratch &at) const {
    SurfaceRow &row = at.row;
    const SurfaceBuffer &surface = at.surface;
    const SurfacePoints &points = picture->points;
    const Material &material = picture->appearance.materials[0];
    const std::array<float, 4> same_phong{material.ka, material.kd, material.ks, material.power};
    const float *const depths = surface.depth.data() + surface.offset(0, y);
    row.count = 0;
    SurfacePoint alone;
    for (int x = 0; x < surface.width; ++x) {
        const float depth = depths[x];
        if (depth == std::numeric_limits<float>::infinity())
            continue;
        const std::size_t to = row.count++;
        const float screen_x = static_cast<float>(x) + 0.5F;
        const float *sums = surface.sums_of(surface.offset(x, y))->channels.data();
        // Sums with less weight, or with normals that cancel each other, are not usable.
        constexpr float kMinWeight = 1e-3F, kMinNormal2 = 1e-2F;
        const auto length2 = [&] { return sums[0] * sums[0] + sums[1] * sums[1] + sums[2] * sums[2]; };
        if (const float weight = sums[channel::kWeight];
            weight < kMinWeight || length2() < kMinNormal2 * weight * weight) {
            read_visible_point(at.visible.id(x, y), sample, {screen_x, static_cast<float>(y) + 0.5F}, alone);
            sums = alone.channels.data();
        }
        const float inverse = 1 / sums[channel::kWeight], inverse_length = 1 / std::sqrt(length2());
        row.x[to] = x;
        row.screen_x[to] = screen_x;
        row.depth[to] = depth;
        for (std::size_t k = 0; k < 3; ++k) {
            row.normal[k][to] = sums[channel::kNormal + k] * inverse_length;
            row.colour[k][to] = sums[channel::kColour + k] * inverse;
        }
        row.environment[to] = sums[channel::kEnvironment] * inverse;
        for (std::size_t k = 0; k < 4; ++k)
            row.phong[k][to] = points.has_phong() ? sums[channel::kPhong + k] * inverse : same_phong[k];
        for (std::size_t light = 0; light < points.shadowed(); ++light)
            row.lit[light][to] = std::clamp(sums[channel::kLit + light] * inverse, 0.0F, 1.0F);
    }
}

// Blends the panorama's light along the mirrored ray into a row.
void FineRenderer::Frame::mirror(const Sample &sample, float screen_y, SurfaceRow &row) const {
    const EyeAxes &axes = picture->projection.axes;
    const auto right = glm::vec3(axes.right), down = glm::vec3(-axes.up), forward = glm::vec3(axes.forward);
    const FrameGeometry &geometry = sample.geometry;
    const auto normal = [&](std::size_t i) { return glm::vec3(row.normal[0][i], row.normal[1][i], row.normal[2][i]); };
    for (std::size_t i = 0; i < row.count; ++i) {
        const float factor = row.environment[i];
        if (factor <= 0)
            continue;
        const glm::vec3 n = normal(i);
        const glm::vec3 ray = glm::normalize(glm::vec3((row.screen_x[i] - geometry.middle_x) * geometry.inverse_focal,
                                                       (screen_y - geometry.middle_y) * geometry.inverse_focal, 1));
        const glm::vec3 mirrored = ray - 2 * glm::dot(n, ray) * n;
        // The mirrored ray turns by twice the angle between the normals of neighbouring pixels, edges excluded.
        float turn = 1;
        if (i > 0 && row.x[i] == row.x[i - 1] + 1)
            turn = glm::distance(n, normal(i - 1));
        if (i + 1 < row.count && row.x[i + 1] == row.x[i] + 1)
            turn = std::min(turn, glm::distance(n, normal(i + 1)));
        const glm::vec3 direction = right * mirrored.x + down * mirrored.y + forward * mirrored.z;
        const Float4 seen = picture->around.reflection(direction, 2 * turn + geometry.inverse_focal);
        for (std::size_t k = 0; k < 3; ++k) {
            float &colour = row.colour[k][i];
            colour += factor * (seen[static_cast<int>(k)] - colour);
        }
    }
}

void FineRenderer::Frame::add_row(int y, const Sample &sample, ThreadScratch &at) {
    const SurfaceRow &row = at.row;
    const auto width = static_cast<std::size_t>(picture->width);
    const std::size_t start = static_cast<std::size_t>(y) * width;
    Float4 *const to = sum_of_light.data() + start;
    const bool is_first = picture->samples == 0;
    if (is_first)
        std::fill_n(to, width, Float4{});
    const float *const depths = at.surface.depth.data() + at.surface.offset(0, y);
    const auto opaque = [&](std::size_t i) { return Float4{row.colour[0][i], row.colour[1][i], row.colour[2][i], 1}; };
    if (picture->around.is_plain()) {
        for (std::size_t i = 0; i < row.count; ++i)
            to[row.x[i]] += opaque(i);
        if (is_first && picture->with_depths)
            std::copy_n(depths, width, first_depth.data() + start);
        return;
    }
    SurroundingsRow &around = at.around;
    picture->around.look(glm::dvec2(0.5, y + 0.5) + sample.offset, width, depths, around);
    std::size_t i = 0;
    for (std::size_t x = 0; x < width; ++x) {
        const bool is_object = i < row.count && static_cast<std::size_t>(row.x[i]) == x;
        if (is_object && around.coverage[x] <= 0)
            to[x] += opaque(i);
        else
            to[x] += Float4{around.red[x], around.green[x], around.blue[x], 1} * around.alpha[x];
        i += is_object;
    }
    if (is_first && picture->with_depths)
        for (std::size_t x = 0; x < width; ++x)
            first_depth[start + x] = around.coverage[x] >= 0.5F ? around.depth[x] : depths[x];
}

// What a sample that meets nothing adds to sums of light: the background, where it is plain.
Float4 FineRenderer::Frame::behind_row(int y, const ColourTable &colours) const {
    if (!picture->around.is_plain())
        return Float4{};
    const Rgba8 background = background_at(picture->options, (y + 0.5) / picture->height);
    return (colours.linear(pack_rgba(background)) + Float4{0, 0, 0, 1}) * (static_cast<float>(background[3]) / 255);
}

void FineRenderer::Frame::resolve_row(int y, const ColourTable &colours, Framebuffer &target) const {
    const auto width = static_cast<std::size_t>(picture->width);
    const std::size_t start = static_cast<std::size_t>(y) * width;
    const std::uint32_t background = pack_rgba(background_at(picture->options, (y + 0.5) / picture->height));
    const auto samples = static_cast<float>(picture->samples);
    const Float4 behind = behind_row(y, colours);
    for (std::size_t i = start; i < start + width; ++i) {
        const Float4 sum = sum_of_light[i];
        if (sum[3] <= 0) {
            target.colour[i] = background;
            continue;
        }
        const float missing = picture->around.is_plain() ? samples - sum[3] : 0;
        const Float4 all = sum + behind * missing;
        const std::uint32_t rgb = colours.pack_srgb(all / all[3]) & 0xFFFFFF;
        const auto alpha = static_cast<std::uint32_t>(std::min(all[3] / samples, 1.0F) * 255 + 0.5F);
        target.colour[i] = rgb | alpha << 24;
    }
    if (target.depth.empty() || !picture->with_depths)
        return;
    const auto edge = static_cast<float>(parameters.grid.edge());
    std::transform(first_depth.begin() + static_cast<std::ptrdiff_t>(start),
                   first_depth.begin() + static_cast<std::ptrdiff_t>(start + width),
                   target.depth.begin() + static_cast<std::ptrdiff_t>(start), [&](float z) { return z * edge; });
}

} // namespace pbm
