// A ball whose attributes change slowly over its surface, drawn by both renderers.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/bricks/chunk_offsets.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "unit/render/test_model.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>

#include <deque>
#include <memory>
#include <vector>

namespace pbm::test {

// Closed: centre (0, -1, -2), radius 0.9, in a cube of edge 2. Attributes vary slowly, so that neighbouring points give
// nearly the same colour. One point in `two_sided_every` is two-sided.
inline Model smooth_ball(int depth, const AttributeSet &set, std::size_t two_sided_every = 1000000) {
    Model model = sphere_model(depth, set);
    model.parameters.closed = true;
    PointAttributes &points = model.levels.back().points;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const UnitVector &n = normal_table()[points.normals[i]];
        const auto byte = [](double value) { return static_cast<std::uint8_t>(127.5 + 120 * value); };
        if (set.colour != ColourFormat::none)
            set_point_colour(points, i, set.colour, {byte(n[0]), byte(n[1]), byte(n[2])});
        if (set.material)
            points.materials[i] = static_cast<std::uint8_t>((n[0] > 0) + (n[1] > 0));
        for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
            const int most = (1 << set.shadow_bits[light][static_cast<std::size_t>(depth)]) - 1;
            points.shadows[light][i] = static_cast<std::uint8_t>(std::max(0.0, most * n[light]));
        }
        // Avoids the radius for which the reference renderer's table is exact only in the middle of an octant.
        points.radii[i] = static_cast<std::uint8_t>(radius_index(0.87 / static_cast<double>(1 << depth)) + 1);
        if (i % two_sided_every == two_sided_every - 1)
            points.normals[i] |= kTwoSidedBit;
    }
    average_levels(model, 1);
    return model;
}

// Views of all chunks of one level of a mapped file, with surface offsets.
class WholeLevel {
  public:
    WholeLevel(ByteView file, int level) : reader_(value_of(Reader::open(file))) {
        const LevelDirectory *directory = value_of(reader_.directory(level));
        views_.reserve(directory->chunks.size());
        for (std::size_t i = 0; i < directory->chunks.size(); ++i) {
            views_.push_back(value_of(reader_.view_chunk(level, i)));
            const ChunkEntry &entry = directory->chunks[i];
            runs.push_back({.chunk = &views_[i],
                            .entry = &entry,
                            .level = level,
                            .last = entry.shape.points,
                            .offsets = &offsets_.emplace_back()});
        }
    }
    WholeLevel(const WholeLevel &) = delete;
    WholeLevel &operator=(const WholeLevel &) = delete;

    void forget_offsets() {
        for (PointRun &run : runs)
            run.offsets = nullptr;
    }
    // Surface offsets of all points of the level.
    std::vector<std::int8_t> offsets() const {
        SurfaceOffsets scratch;
        std::vector<std::int8_t> all;
        for (const PointRun &run : runs) {
            std::vector<std::int8_t> some(run.chunk->normals.size());
            scratch.estimate(*run.chunk, some);
            all.insert(all.end(), some.begin(), some.end());
        }
        return all;
    }

    std::vector<PointRun> runs;

  private:
    Reader reader_;
    std::vector<ChunkView> views_;
    std::deque<ChunkOffsets> offsets_;
};

// A model with a mapped file of it.
struct DrawnModel {
    explicit DrawnModel(Model m, std::uint32_t chunk_size = 4096)
        : model(std::move(m)), chunk_points(chunk_size),
          file(value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = chunk_size, .threads = 1}))) {}

    Framebuffer reference(const Camera &camera, int width, int height, const RenderOptions &options,
                          int level = kMaxDepth) const {
        Framebuffer target(width, height);
        ReferenceRenderer renderer(model);
        level = std::min(level, model.parameters.grid.depth);
        if (placed && level > 0)
            renderer.set_offsets(level, WholeLevel(file, level).offsets());
        renderer.render(camera, options, target, {.level = level});
        return target;
    }
    // Draws the same single level as reference().
    Framebuffer fast(const Camera &camera, int width, int height, const RenderOptions &options,
                     int level = kMaxDepth) const {
        Framebuffer target(width, height);
        WholeLevel drawn(file, std::min(level, model.parameters.grid.depth));
        if (!placed)
            drawn.forget_offsets();
        FastRenderer(model.parameters, chunk_points, 1).render(drawn.runs, camera, options, target);
        return target;
    }

    Model model;
    std::uint32_t chunk_points;
    Bytes file;
    bool placed = true; // both renderers apply surface offsets
};

// Looks at the centre of smooth_ball along `direction`; there a voxel of `level` is `pixels` wide.
inline Camera camera_at_ball(int level, double pixels, int height, glm::dvec3 direction = {0.3, 0.5, 0.8}) {
    Camera camera;
    camera.focal_point = {0, -1, -2};
    const double seen = std::ldexp(2.0, -level) / pixels * height; // model units
    const double distance = std::max(3.0, seen / (2 * std::tan(camera.view_angle / 2)));
    camera.position = camera.focal_point + distance * glm::normalize(direction);
    camera.view_angle = 2 * std::atan(seen / 2 / distance);
    return camera;
}

} // namespace pbm::test
