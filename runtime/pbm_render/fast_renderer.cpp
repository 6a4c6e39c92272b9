#include "pbm_render/fast_renderer.h"

#include "pbm_format/parallel.h"
#include "pbm_render/brick_splatter.h"
#include "pbm_render/point_shader.h"
#include "pbm_render/strip_pixels.h"
#include "pbm_render/unit_grid.h"
#include "pbm_render/worker_pool.h"

#include <algorithm>
#include <bit>
#include <optional>

namespace pbm {
namespace {

// A megabyte: little enough for the cache, much enough that few bricks lie in two strips. Several threads share the
// work more evenly if it comes in smaller pieces.
constexpr int kStripPixels = 128 * 1024, kSharedStripPixels = 80 * 1024;
constexpr int kLeastStripRows = 16;

int strip_rows(int width, int threads) {
    return std::max(kLeastStripRows, (threads == 1 ? kStripPixels : kSharedStripPixels) / width);
}

// Where a run's part of the picture is.
struct DrawnRun {
    RunGeometry geometry;
    std::size_t first_brick = 0, seen = 0; // in Frame::bricks
    int top = 0, bottom = 0;
};

// Of a run's chunk, close together since every pixel asks for them.
struct StreamPointers {
    const std::uint16_t *normals;
    const std::uint8_t *colours, *materials, *textures; // null without
};

// What pixels of a frame show.
struct FrameLook {
    const RenderOptions &options;
    const PointShader &shader;
    const SurroundingsView &surroundings;
};

} // namespace

struct FastRenderer::Frame {
    Frame(const ModelParameters &p, std::uint32_t chunk_points, int threads, std::shared_ptr<const Surroundings> s)
        : parameters(p), surroundings(std::move(s)), appearance(p),
          point_bits(static_cast<int>(std::bit_width(chunk_points - 1))), pool(resolve_threads(threads)),
          strips(static_cast<std::size_t>(pool.threads())) {}

    void cull(std::size_t run, const FrameGeometry &geometry);
    std::uint64_t draw(int top, int rows, const FrameGeometry &geometry, const FrameLook &look, DepthStrip &strip,
                       Framebuffer &target) const;
    void resolve(const DepthStrip &strip, const FrameLook &look, Framebuffer &target) const;
    void read_looks(const CoveredPixels &pixels, const PointShader &shader, std::span<PointLook> looks) const;
    template <bool kSpecial>
    void shade_row(const CoveredPixels &pixels, std::span<const PointLook> looks, int y, const PointShader &shader,
                   std::uint32_t *colours) const;
    float lit_fraction(std::size_t light, std::uint32_t id) const;

    const ModelParameters &parameters;
    const std::shared_ptr<const Surroundings> surroundings;
    Appearance appearance;
    const int point_bits; // of an id; the rest is the run
    WorkerPool pool;

    std::vector<DrawnRun> runs;
    std::vector<StreamPointers> streams; // [runs]
    std::vector<SeenBrick> bricks;
    std::vector<DepthStrip> strips; // [thread]
};

FastRenderer::FastRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, int threads,
                           std::shared_ptr<const Surroundings> surroundings)
    : frame_(std::make_unique<Frame>(parameters, chunk_points, threads, std::move(surroundings))) {}

FastRenderer::~FastRenderer() = default;

void FastRenderer::set_appearance(Appearance appearance) {
    assert(appearance.materials.size() == frame_->parameters.materials.size());
    frame_->appearance = std::move(appearance);
}

RenderStatistics FastRenderer::render(std::span<const PointRun> runs, const Camera &camera,
                                      const RenderOptions &options, Framebuffer &target) {
    Frame &frame = *frame_;
    const Projection projection(in_unit_grid(camera, frame.parameters.grid), target.width, target.height);
    const FrameGeometry geometry(projection, target.width, target.height);
    RenderStatistics statistics;
    frame.runs.clear();
    frame.streams.clear();
    std::size_t bricks = 0;
    runs = runs.first(std::min(runs.size(), std::size_t{1} << (32 - frame.point_bits))); // as many as ids can tell
    for (const PointRun &run : runs) {
        frame.runs.push_back({RunGeometry(run, geometry), bricks});
        frame.streams.push_back({run.chunk->normals.data(), run.chunk->colours.data(), run.chunk->materials.data(),
                                 run.chunk->textures.data()});
        bricks += run.chunk->bricks.size();
        statistics.level = std::max(statistics.level, run.level);
        statistics.points += run.last - run.first;
    }
    if (frame.bricks.size() < bricks)
        frame.bricks.resize(bricks);
    const SurroundingsView surroundings(frame.surroundings.get(), frame.appearance, projection, options);
    std::optional<PointShader> shader;
    frame.pool.run(runs.size() + 1, [&](std::size_t item, std::size_t) {
        if (item == 0) // takes longest
            shader.emplace(frame.parameters, frame.appearance, projection, surroundings, options);
        else
            frame.cull(item - 1, geometry);
    });

    const int rows = strip_rows(target.width, frame.pool.threads());
    const auto count = static_cast<std::size_t>((target.height + rows - 1) / rows);
    std::vector<std::uint64_t> drawn(count);
    const FrameLook look{options, *shader, surroundings};
    frame.pool.run(count, [&](std::size_t i, std::size_t thread) {
        drawn[i] = frame.draw(static_cast<int>(i) * rows, rows, geometry, look, frame.strips[thread], target);
    });
    for (const std::uint64_t points : drawn)
        statistics.drawn_points += points;
    return statistics;
}

void FastRenderer::Frame::cull(std::size_t index, const FrameGeometry &geometry) {
    DrawnRun &run = runs[index];
    const std::span<SeenBrick> room(bricks.data() + run.first_brick, run.geometry.run->chunk->bricks.size());
    run.seen = find_seen_bricks(run.geometry, geometry, room);
    run.top = geometry.height;
    run.bottom = 0;
    for (const SeenBrick &brick : room.first(run.seen)) {
        run.top = std::min(run.top, brick.top);
        run.bottom = std::max(run.bottom, brick.bottom);
    }
}

// Draws the strip of `rows` rows from row `top` on. Returns the points drawn.
std::uint64_t FastRenderer::Frame::draw(int top, int rows, const FrameGeometry &geometry, const FrameLook &look,
                                        DepthStrip &strip, Framebuffer &target) const {
    strip.begin(target.width, top, std::min(top + rows, target.height));
    std::uint64_t drawn = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const DrawnRun &run = runs[i];
        if (run.top < strip.bottom && run.bottom > strip.top)
            drawn += draw_bricks(geometry, run.geometry, std::span(bricks).subspan(run.first_brick, run.seen),
                                 static_cast<std::uint32_t>(i) << point_bits, strip);
    }
    resolve(strip, look, target);
    return drawn;
}

// Colours and depths of a strip's pixels.
void FastRenderer::Frame::resolve(const DepthStrip &strip, const FrameLook &look, Framebuffer &target) const {
    const std::uint32_t background = pack_rgba(look.options.background);
    const auto edge = static_cast<float>(parameters.grid.edge());
    const auto width = static_cast<std::size_t>(target.width);
    CoveredPixels covered(target.width);
    std::vector<PointLook> looks(width);
    const bool is_plain = look.surroundings.is_plain();
    const PointShader &shader = look.shader;
    SurroundingsRow behind;
    std::vector<float> row_depths(is_plain || !target.depth.empty() ? 0 : width);
    for (int y = strip.top; y < strip.bottom; ++y) {
        const std::size_t row = static_cast<std::size_t>(y) * width;
        std::uint32_t *const colours = target.colour.data() + row;
        float *const depths = !target.depth.empty() ? target.depth.data() + row
                              : is_plain            ? nullptr
                                                    : row_depths.data();
        read_row(strip, y, background, edge, colours, depths, covered);
        // Two loops, so that the first waits for many points at once to come from memory.
        read_looks(covered, shader, looks);
        if (shader.is_special())
            shade_row<true>(covered, looks, y, shader, colours);
        else
            shade_row<false>(covered, looks, y, shader, colours);
        if (!is_plain)
            look.surroundings.draw_row(y, width, edge, colours, depths, behind);
    }
}

template <bool kSpecial>
void FastRenderer::Frame::shade_row(const CoveredPixels &pixels, std::span<const PointLook> looks, int y,
                                    const PointShader &shader, std::uint32_t *colours) const {
    for (std::size_t i = 0; i < pixels.count; ++i) {
        const auto x = static_cast<std::size_t>(pixels.x[i]);
        const glm::vec2 pixel(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        colours[x] = shader.shade<kSpecial>(looks[i], pixel, pixels.depth[i], [&](std::size_t light) {
            return lit_fraction(light, static_cast<std::uint32_t>(pixels.id[i]));
        });
    }
}

void FastRenderer::Frame::read_looks(const CoveredPixels &pixels, const PointShader &shader,
                                     std::span<PointLook> looks) const {
    const ColourSource source = shader.colour_source();
    const std::uint32_t point_mask = (1U << point_bits) - 1;
    const std::size_t colour_bytes = static_cast<std::size_t>(parameters.attributes.colour_bytes());
    const auto last_material = static_cast<std::uint16_t>(parameters.materials.size() - 1);
    for (std::size_t i = 0; i < pixels.count; ++i) {
        constexpr std::size_t kAhead = 16;
        const auto soon = static_cast<std::uint32_t>(pixels.id[std::min(i + kAhead, pixels.count - 1)]);
        const StreamPointers &next = streams[soon >> point_bits];
        __builtin_prefetch(next.normals + (soon & point_mask));
        __builtin_prefetch(next.colours + (soon & point_mask) * colour_bytes);

        const auto id = static_cast<std::uint32_t>(pixels.id[i]);
        const StreamPointers &from = streams[id >> point_bits];
        const std::size_t point = id & point_mask;
        std::uint32_t packed = 0;
        if (source == ColourSource::rgb888) {
            const std::uint8_t *const rgb = from.colours + 3 * point;
            packed = std::uint32_t{rgb[0]} | std::uint32_t{rgb[1]} << 8 | std::uint32_t{rgb[2]} << 16;
        } else if (source == ColourSource::rgb565) {
            const std::uint8_t *const rgb = from.colours + 2 * point;
            packed = pack_rgb(expand_565(static_cast<std::uint16_t>(rgb[0] | rgb[1] << 8)));
        } else if (source == ColourSource::texture) {
            packed = shader.palette()[from.textures[point]];
        }
        looks[i] = {.colour = packed,
                    .normal = from.normals[point],
                    .material = from.materials != nullptr ? std::uint16_t{from.materials[point]} : std::uint16_t{0}};
        looks[i].material = std::min(looks[i].material, last_material); // whatever a mapped file's bytes became
    }
}

float FastRenderer::Frame::lit_fraction(std::size_t light, std::uint32_t id) const {
    const PointRun &run = *runs[id >> point_bits].geometry.run;
    const unsigned bits = parameters.attributes.shadow_bits[light][static_cast<std::size_t>(run.level)];
    const std::size_t at = (id & ((1U << point_bits) - 1)) * bits;
    const unsigned value = run.chunk->packed_shadows[light][at / 8] >> (at % 8) & ((1U << bits) - 1);
    return static_cast<float>(value) / static_cast<float>((1U << bits) - 1);
}

} // namespace pbm
