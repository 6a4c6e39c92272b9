#include "pbm_render/fast/fast_renderer.h"

#include "pbm_render/bricks/drawn_runs.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/fast/brick_splatter.h"
#include "pbm_render/fast/point_reader.h"
#include "pbm_render/fast/strip_pixels.h"
#include "pbm_render/shading/point_shader.h"
#include "pbm_render/shading/surface_shader.h"
#include "pbm_render/splats/brick_bounds.h"
#include "pbm_render/surroundings/surroundings.h"
#include "pbm_render/surroundings/surroundings_view.h"
#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <optional>

namespace pbm {
namespace {

// A strip of two megabytes fits the cache; few bricks lie in two. With several threads, smaller strips balance the
// load.
constexpr int kMaxStripPixels = 256 * 1024, kMinStripPixels = 80 * 1024;
constexpr int kStripsPerThread = 4;
constexpr int kMinStripRows = 16;

int strip_rows(const Framebuffer &target, int threads) {
    const std::size_t balanced = target.pixels() / static_cast<std::size_t>(threads * kStripsPerThread);
    const int pixels = threads == 1
                           ? kMaxStripPixels
                           : static_cast<int>(std::clamp<std::size_t>(balanced, kMinStripPixels, kMaxStripPixels));
    return std::max(kMinStripRows, pixels / target.width);
}

// Memory of one thread.
struct ThreadScratch {
    DepthStrip strip;
    StripBricks bricks;
    BackScratch backs;
};

// Which strips of a frame are done, drawn or given up.
class StripProgress {
  public:
    explicit StripProgress(std::size_t strips) : done_(strips) {}

    // Waits for the first `strips` strips.
    void wait_for(std::size_t strips) const {
        for (std::size_t i = 0; i < strips; ++i)
            done_[i].wait(false);
    }

    // Marks a strip as done when it is destroyed, also by an exception: no thread may wait for it for ever.
    class Strip {
      public:
        Strip(StripProgress &progress, std::size_t index) : done_(progress.done_[index]) {}
        ~Strip() {
            done_ = true;
            done_.notify_all();
        }
        Strip(const Strip &) = delete;
        Strip &operator=(const Strip &) = delete;

      private:
        std::atomic<bool> &done_;
    };

  private:
    std::vector<std::atomic<bool>> done_;
};

// Values that all strips of a frame share.
struct FrameView {
    const RenderOptions &options;
    const FrameGeometry &geometry;
    const Appearance &appearance; // in this frame
    const PointLighting &lighting;
    const PointShader &shader;
    const SurroundingsView &surroundings;
    Framebuffer &target;
    std::span<ShownPoint> shown;
};

// The points of a row. `shown`: of the row's first pixel on.
void name_points(const CoveredPixels &covered, PointIds ids, std::span<ShownPoint> shown) {
    for (std::size_t i = 0; i < covered.count; ++i) {
        const auto id = static_cast<std::uint32_t>(covered.id[i]);
        shown[static_cast<std::size_t>(covered.x[i])] = {
            static_cast<std::uint32_t>(ids.run(id)), static_cast<std::uint32_t>(ids.point(id)), PointIds::is_back(id)};
    }
}

} // namespace

struct FastRenderer::Frame {
    Frame(const ModelParameters &p, std::uint32_t chunk_points, std::shared_ptr<ThreadPool> threads,
          std::shared_ptr<const Surroundings> s)
        : parameters(p), surroundings(std::move(s)), appearance(p), runs(chunk_points), pool(std::move(threads)),
          thread_scratch(static_cast<std::size_t>(pool->threads())) {}

    std::uint64_t draw(int top, int rows, const FrameView &view, ThreadScratch &scratch) const;
    void resolve(const DepthStrip &strip, const FrameView &view) const;

    const ModelParameters &parameters;
    const std::shared_ptr<const Surroundings> surroundings;
    Appearance appearance;
    DrawnRuns runs;
    const std::shared_ptr<ThreadPool> pool;

    PointReader reader;
    std::vector<ThreadScratch> thread_scratch; // [thread]
};

FastRenderer::FastRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, int threads,
                           std::shared_ptr<const Surroundings> surroundings)
    : FastRenderer(parameters, chunk_points, std::make_shared<ThreadPool>(resolve_threads(threads)),
                   std::move(surroundings)) {}

FastRenderer::FastRenderer(const ModelParameters &parameters, std::uint32_t chunk_points,
                           std::shared_ptr<ThreadPool> pool, std::shared_ptr<const Surroundings> surroundings)
    : frame_(std::make_unique<Frame>(parameters, chunk_points, std::move(pool), std::move(surroundings))) {}

FastRenderer::~FastRenderer() = default;

void FastRenderer::set_appearance(Appearance appearance) {
    assert(appearance.materials.size() == frame_->parameters.materials.size());
    frame_->appearance = std::move(appearance);
}

RenderStatistics FastRenderer::render(std::span<const PointRun> runs, const Camera &camera,
                                      const RenderOptions &options, Framebuffer &target, const RowTasks &tasks,
                                      std::span<ShownPoint> shown) {
    Frame &frame = *frame_;
    const Projection projection(in_unit_grid(camera, frame.parameters), target.width, target.height);
    const FrameGeometry geometry(projection, target.width, target.height);
    frame.runs.set(runs);
    frame.runs.begin_view(geometry);
    const Grid &grid = frame.parameters.grid;
    const Appearance appearance = appearance_in_frame(frame.parameters, options, projection.axes, frame.appearance);
    frame.reader.begin(frame.parameters, appearance, frame.runs);
    const std::vector<EyeLight> lights = lights_in_eye_space(appearance.lights, grid.edge(), projection);
    const SurroundingsView surroundings(frame.surroundings.get(), appearance, projection, options);
    std::optional<PointShader> shader;
    frame.pool->run(frame.runs.size() + 1, [&](std::size_t item, std::size_t) {
        if (item == 0) { // first, since it takes longest
            shader.emplace(frame.parameters, appearance, projection, &surroundings, options, false);
            return;
        }
        frame.runs.cull(item - 1, geometry, [&](const RunGeometry &run, std::span<VisibleBrick> seen) {
            bound_bricks(geometry, run, seen);
        });
        frame.runs.estimate_offsets(item - 1);
    });

    const int rows = strip_rows(target, frame.pool->threads());
    const auto count = static_cast<std::size_t>((target.height + rows - 1) / rows);
    std::vector<std::uint64_t> drawn(count);
    PointLighting lighting =
        make_point_lighting({geometry.middle_x, geometry.middle_y, geometry.inverse_focal}, projection, lights);
    lighting.shadowed = shader->shadowed();
    lighting.one_material = !frame.parameters.attributes.material;
    lighting.mirrors = shader->mirrors();
    const FrameView view{options, geometry, appearance, lighting, *shader, surroundings, target, shown};
    StripProgress progress(count);
    // Strips come first: when a task waits for one, another thread draws it.
    frame.pool->run(count + tasks.count, [&](std::size_t i, std::size_t thread) {
        if (i < count) {
            const StripProgress::Strip strip(progress, i);
            drawn[i] = frame.draw(static_cast<int>(i) * rows, rows, view, frame.thread_scratch[thread]);
        } else {
            progress.wait_for(static_cast<std::size_t>((tasks.end_row(i - count) + rows - 1) / rows));
            tasks.run(i - count, thread);
        }
    });
    RenderStatistics statistics = frame.runs.statistics();
    for (const std::uint64_t points : drawn)
        statistics.drawn_points += points;
    return statistics;
}

// Draws `rows` rows from row `top` on. Returns the number of points drawn.
std::uint64_t FastRenderer::Frame::draw(int top, int rows, const FrameView &view, ThreadScratch &scratch) const {
    DepthStrip &strip = scratch.strip;
    strip.begin(view.target.width, top, std::min(top + rows, view.target.height));
    scratch.bricks.collect(runs, strip.top, strip.bottom);
    const std::uint64_t drawn = draw_bricks(view.geometry, scratch.bricks, strip, scratch.backs);
    resolve(strip, view);
    return drawn;
}

// Writes colours and depths of a strip's pixels to the target.
void FastRenderer::Frame::resolve(const DepthStrip &strip, const FrameView &view) const {
    Framebuffer &target = view.target;
    const auto edge = static_cast<float>(parameters.grid.edge());
    const auto width = static_cast<std::size_t>(target.width);
    CoveredPixels covered(target.width);
    const bool is_plain = view.surroundings.is_plain();
    const ShadedFrame shaded{view.geometry, view.appearance, view.shader, view.lighting};
    PointRow points(target.width);
    SurroundingsRow behind;
    std::vector<float> row_depths(is_plain || !target.depth.empty() ? 0 : width);
    for (int y = strip.top; y < strip.bottom; ++y) {
        const std::size_t row = static_cast<std::size_t>(y) * width;
        std::uint32_t *const colours = target.colour.data() + row;
        float *const depths = !target.depth.empty() ? target.depth.data() + row
                              : is_plain            ? nullptr
                                                    : row_depths.data();
        const PixelRow to{colours, depths, width, edge};
        write_row(strip, y, pack_rgba(background_at(view.options, (y + 0.5) / target.height)), to, covered);
        if (!view.shown.empty())
            name_points(covered, runs.ids(), view.shown.subspan(row, width));
        reader.read(covered, y, shaded, points);
        if (!view.shader.has_shaded_normals())
            shade_points(view.lighting, {covered.x.data(), covered.depth.data(), static_cast<float>(y) + 0.5F}, points);
        for (std::size_t i = 0; i < points.count; ++i)
            colours[covered.x[i]] = points.colour[i];
        if (!is_plain)
            view.surroundings.draw_row(y, to, behind);
    }
}

} // namespace pbm
