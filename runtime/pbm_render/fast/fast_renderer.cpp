#include "pbm_render/fast/fast_renderer.h"

#include "pbm_render/bricks/drawn_runs.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/fast/brick_bounds.h"
#include "pbm_render/fast/brick_splatter.h"
#include "pbm_render/fast/strip_pixels.h"
#include "pbm_render/shading/point_shader.h"
#include "pbm_render/shading/surface_shader.h"
#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"

#include <algorithm>
#include <atomic>
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

// Pointers to the streams of a run's chunk, in one struct since every pixel reads them.
struct StreamPointers {
    const std::uint16_t *normals;
    const std::uint8_t *colours, *materials, *indices; // null: the model lacks the stream
};

// Memory of one thread.
struct Workplace {
    SurfaceOffsets offsets;
    DepthStrip strip;
    StripBricks bricks;
};

// The point and spot lights of a frame.
struct PositionalLights {
    PositionalLights(const ModelParameters &parameters, const Appearance &appearance, const Projection &projection) {
        std::vector<Light> lights;
        for (std::size_t i = 0; i < appearance.lights.size(); ++i)
            if (appearance.lights[i].kind != LightKind::directional) {
                lights.push_back(appearance.lights[i]);
                indices.push_back(i);
            }
        seen = see_lights(lights, parameters.grid.edge(), projection);
    }
    // How many of them have an index below `end`.
    std::size_t below(std::size_t end) const {
        return static_cast<std::size_t>(std::lower_bound(indices.begin(), indices.end(), end) - indices.begin());
    }

    std::vector<EyeLight> seen;
    std::vector<std::size_t> indices; // among all lights, ascending
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
    const PositionalLights &lights;
    const PointShader &shader;
    const SurroundingsView &surroundings;
    Framebuffer &target;
};

} // namespace

struct FastRenderer::Frame {
    Frame(const ModelParameters &p, std::uint32_t chunk_points, std::shared_ptr<ThreadPool> threads,
          std::shared_ptr<const Surroundings> s)
        : parameters(p), surroundings(std::move(s)), appearance(p), runs(chunk_points), pool(std::move(threads)),
          workplaces(static_cast<std::size_t>(pool->threads())) {}

    std::uint64_t draw(int top, int rows, const FrameView &view, Workplace &workplace) const;
    void resolve(const DepthStrip &strip, const FrameView &view) const;
    void read_looks(const CoveredPixels &pixels, const PointShader &shader, std::span<PointLook> looks) const;
    void light_row(const CoveredPixels &pixels, std::span<const PointLook> looks, int y, const FrameView &view,
                   SurfaceRow &row) const;
    template <bool kSpecial>
    void shade_pixels(const CoveredPixels &pixels, std::span<const PointLook> looks, int y, const PointShader &shader,
                      const SurfaceRow &positional, std::uint32_t *colours) const;
    float lit(std::uint32_t id, std::size_t light) const {
        const PointRun &run = runs[runs.ids().run(id)];
        return lit_fraction(run, runs.ids().point(id), light,
                            parameters.attributes.shadow_bits[light][static_cast<std::size_t>(run.level)]);
    }

    const ModelParameters &parameters;
    const std::shared_ptr<const Surroundings> surroundings;
    Appearance appearance;
    DrawnRuns runs;
    const std::shared_ptr<ThreadPool> pool;

    std::vector<StreamPointers> streams; // [runs]
    std::vector<Workplace> workplaces;   // [thread]
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
                                      const RenderOptions &options, Framebuffer &target, const RowTasks &tasks) {
    Frame &frame = *frame_;
    const Projection projection(in_unit_grid(camera, frame.parameters.grid), target.width, target.height);
    const FrameGeometry geometry(projection, target.width, target.height);
    frame.runs.set(runs);
    frame.runs.begin_view(geometry);
    const std::optional<StreamInfo> indices = palette_stream(frame.parameters.attributes);
    frame.streams.clear();
    for (std::size_t i = 0; i < frame.runs.size(); ++i) {
        const ChunkView &chunk = *frame.runs[i].chunk;
        frame.streams.push_back({chunk.normals.data(), chunk.colours.data(), chunk.materials.data(),
                                 indices ? chunk.values(*indices).data() : nullptr});
    }
    const PositionalLights lights(frame.parameters, frame.appearance, projection);
    const SurroundingsView surroundings(frame.surroundings.get(), frame.appearance, projection, options);
    std::optional<PointShader> shader;
    frame.pool->run(frame.runs.size() + 1, [&](std::size_t item, std::size_t thread) {
        if (item == 0) // first, since it takes longest
            shader.emplace(frame.parameters, frame.appearance, projection, &surroundings, options);
        else
            frame.runs.cull(
                item - 1, geometry, frame.workplaces[thread].offsets,
                [&](const RunGeometry &run, std::span<SeenBrick> seen) { bound_bricks(geometry, run, seen); });
    });

    const int rows = strip_rows(target, frame.pool->threads());
    const auto count = static_cast<std::size_t>((target.height + rows - 1) / rows);
    std::vector<std::uint64_t> drawn(count);
    const FrameView view{options, geometry, lights, *shader, surroundings, target};
    StripProgress progress(count);
    // Strips come first: when a task waits for one, another thread draws it.
    frame.pool->run(count + tasks.count, [&](std::size_t i, std::size_t thread) {
        if (i < count) {
            const StripProgress::Strip strip(progress, i);
            drawn[i] = frame.draw(static_cast<int>(i) * rows, rows, view, frame.workplaces[thread]);
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
std::uint64_t FastRenderer::Frame::draw(int top, int rows, const FrameView &view, Workplace &workplace) const {
    DepthStrip &strip = workplace.strip;
    strip.begin(view.target.width, top, std::min(top + rows, view.target.height));
    workplace.bricks.collect(runs, strip.top, strip.bottom);
    const std::uint64_t drawn = draw_bricks(view.geometry, workplace.bricks, strip);
    resolve(strip, view);
    return drawn;
}

// Writes colours and depths of a strip's pixels to the target.
void FastRenderer::Frame::resolve(const DepthStrip &strip, const FrameView &view) const {
    Framebuffer &target = view.target;
    const std::uint32_t background = pack_rgba(view.options.background);
    const auto edge = static_cast<float>(parameters.grid.edge());
    const auto width = static_cast<std::size_t>(target.width);
    CoveredPixels covered(target.width);
    std::vector<PointLook> looks(width);
    const bool is_plain = view.surroundings.is_plain();
    const PointShader &shader = view.shader;
    SurfaceRow positional(shader.is_positional() ? target.width : 0);
    SurroundingsRow behind;
    std::vector<float> row_depths(is_plain || !target.depth.empty() ? 0 : width);
    for (int y = strip.top; y < strip.bottom; ++y) {
        const std::size_t row = static_cast<std::size_t>(y) * width;
        std::uint32_t *const colours = target.colour.data() + row;
        float *const depths = !target.depth.empty() ? target.depth.data() + row
                              : is_plain            ? nullptr
                                                    : row_depths.data();
        const PixelRow to{colours, depths, width, edge};
        read_row(strip, y, background, to, covered);
        // Two loops, so that the cache misses of many points overlap in the first one.
        read_looks(covered, shader, looks);
        if (shader.is_positional())
            light_row(covered, looks, y, view, positional);
        if (shader.is_special())
            shade_pixels<true>(covered, looks, y, shader, positional, colours);
        else
            shade_pixels<false>(covered, looks, y, shader, positional, colours);
        if (!is_plain)
            view.surroundings.draw_row(y, to, behind);
    }
}

// Computes what point and spot lights add to the reflection of white points: the colours of `row`.
void FastRenderer::Frame::light_row(const CoveredPixels &pixels, std::span<const PointLook> looks, int y,
                                    const FrameView &view, SurfaceRow &row) const {
    const float screen_y = static_cast<float>(y) + 0.5F;
    const std::size_t shadowed = view.lights.below(view.shader.shadowed());
    row.count = pixels.count;
    for (std::size_t i = 0; i < pixels.count; ++i) {
        const float screen_x = static_cast<float>(pixels.x[i]) + 0.5F;
        const EyeNormal &normal = view.geometry.normals[view.shader.normal_seen(looks[i], {screen_x, screen_y})];
        const Material &material = appearance.materials[looks[i].material];
        row.screen_x[i] = screen_x;
        row.depth[i] = pixels.depth[i];
        row.normal[0][i] = normal.x;
        row.normal[1][i] = normal.y;
        row.normal[2][i] = normal.z;
        row.colour[0][i] = row.colour[1][i] = row.colour[2][i] = 1;
        row.phong[0][i] = 0; // the shader's table has the ambient light
        row.phong[1][i] = material.kd;
        row.phong[2][i] = material.ks;
        row.phong[3][i] = material.power;
        for (std::size_t light = 0; light < shadowed; ++light)
            row.lit[light][i] = lit(static_cast<std::uint32_t>(pixels.id[i]), view.lights.indices[light]);
    }
    const EyeRays rays{view.geometry.middle_x, view.geometry.middle_y, view.geometry.inverse_focal};
    shade_row(rays, view.lights.seen, shadowed, screen_y, row);
}

// `positional`: the result of light_row if there are point or spot lights.
template <bool kSpecial>
void FastRenderer::Frame::shade_pixels(const CoveredPixels &pixels, std::span<const PointLook> looks, int y,
                                       const PointShader &shader, const SurfaceRow &positional,
                                       std::uint32_t *colours) const {
    for (std::size_t i = 0; i < pixels.count; ++i) {
        const auto x = static_cast<std::size_t>(pixels.x[i]);
        const glm::vec2 pixel(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        colours[x] = shader.shade<kSpecial>(
            looks[i], pixel, [&](std::size_t light) { return lit(static_cast<std::uint32_t>(pixels.id[i]), light); },
            [&] {
                return Float4{positional.colour[0][i], positional.colour[1][i], positional.colour[2][i], 0};
            });
    }
}

void FastRenderer::Frame::read_looks(const CoveredPixels &pixels, const PointShader &shader,
                                     std::span<PointLook> looks) const {
    const PointIds ids = runs.ids();
    const bool from_texture = shader.colour_source() == ColourSource::texture;
    const ColourFormat format = shader.point_colours();
    const std::size_t colour_bytes = static_cast<std::size_t>(parameters.attributes.colour_bytes());
    const auto last_material = static_cast<std::uint16_t>(parameters.materials.size() - 1);
    for (std::size_t i = 0; i < pixels.count; ++i) {
        constexpr std::size_t kAhead = 16;
        const auto soon = static_cast<std::uint32_t>(pixels.id[std::min(i + kAhead, pixels.count - 1)]);
        const StreamPointers &next = streams[ids.run(soon)];
        __builtin_prefetch(next.normals + ids.point(soon));
        __builtin_prefetch(next.colours + ids.point(soon) * colour_bytes);

        const auto id = static_cast<std::uint32_t>(pixels.id[i]);
        const StreamPointers &from = streams[ids.run(id)];
        const std::size_t point = ids.point(id);
        const std::uint32_t packed =
            from_texture ? shader.palette()[from.indices[point]] : pack_rgb(point_colour(from.colours, point, format));
        looks[i] = {.colour = packed,
                    .normal = from.normals[point],
                    .material = from.materials != nullptr ? std::uint16_t{from.materials[point]} : std::uint16_t{0}};
        looks[i].material = std::min(looks[i].material, last_material); // the bytes of a mapped file may have changed
    }
}

} // namespace pbm
