// The fast renderer: culls bricks, projects their points and draws them with SIMD into strips of the picture that stay
// in the cache; it shades visible pixels only. Its pictures show what those of the ReferenceRenderer show.
// Based on: Rusinkiewicz, Levoy. QSplat. 2000 (level by projected size, normal cones); Zwicker, Pfister, van Baar,
// Gross. EWA Splatting. 2002 (shape of a splat, see splat.h)
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/point_run.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "system/threads/thread_pool.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

namespace pbm {

class Surroundings; // pbm_render/surroundings/surroundings.h

// Work on the rows of a picture that are finished while others are still drawn.
struct RowTasks {
    std::size_t count = 0;
    // A task needs the rows 0 .. end_row(task) - 1 of the picture. Must ascend with `task`.
    std::function<int(std::size_t task)> end_row = {};
    // Called once per task, in any order, by thread number `thread` of the renderer's threads.
    std::function<void(std::size_t task, std::size_t thread)> run = {};
};

// The point that a pixel shows: its place in the runs of the picture.
struct ShownPoint {
    static constexpr std::uint32_t kNone = 0xFFFFFFFF;
    std::uint32_t run = kNone, point = 0; // kNone: the pixel shows no point. `point`: of the run's chunk
    bool back = false;                    // seen from behind its normal
};

class FastRenderer {
  public:
    // `parameters` must outlive the renderer. `chunk_points` is that of the file's header. `threads`: 0 asks for one
    // per processor. Without `surroundings` the background has one colour.
    FastRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, int threads,
                 std::shared_ptr<const Surroundings> surroundings = nullptr);
    // The same with a shared thread pool, which nobody else may use during `render`.
    FastRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, std::shared_ptr<ThreadPool> pool,
                 std::shared_ptr<const Surroundings> surroundings = nullptr);
    ~FastRenderer();
    FastRenderer(const FastRenderer &) = delete;
    FastRenderer &operator=(const FastRenderer &) = delete;

    // Takes effect with the next frame: only per-frame tables depend on the appearance.
    void set_appearance(Appearance appearance);

    // Draws one frame; overwrites all of `target`. Depths, if `target` has them, are those of object and ground; the
    // panorama has none. The picture is the same for any number of threads and any SIMD target.
    //
    // The camera must be usable. The chunks of `runs` must be verified; if the bytes of a mapped file change later,
    // only the picture is wrong. Draws the first 2^31 / `chunk_points` runs, rounded down to a power of two.
    // Estimates surface offsets that were not estimated on loading. Runs each of `tasks` once the rows that it needs
    // are finished. Fills `shown`, [height][width], unless it is empty. Only one thread at a time may call this
    // function.
    RenderStatistics render(std::span<const PointRun> runs, const Camera &camera, const RenderOptions &options,
                            Framebuffer &target, const RowTasks &tasks = {}, std::span<ShownPoint> shown = {});

  private:
    struct Frame;
    std::unique_ptr<Frame> frame_;
};

} // namespace pbm
