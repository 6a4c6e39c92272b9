// Draws a model with a look. All programs draw through it.
#pragma once

#include "pbm_render/appearance/legend.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/surroundings/surroundings.h"
#include "system/threads/thread_pool.h"
#include "viewer/pictures/exr_writer.h"
#include "viewer/scene/look.h"
#include "viewer/scene/scene.h"

#include <glm/vec2.hpp>

#include <atomic>
#include <memory>
#include <optional>
#include <span>

namespace pbm {

class Painter {
  public:
    // `scene` must outlive the painter. `pool` draws fast pictures; null: `threads` threads of its own.
    Painter(const StreamedScene &scene, int threads, std::shared_ptr<ThreadPool> pool = nullptr);

    // Draws a picture with the quality that `look` has for such a motion. Runs `tasks`, in fast pictures without a
    // depth cue while other rows are drawn.
    RenderStatistics draw(std::span<const PointRun> runs, const Camera &camera, const Look &look, Motion motion,
                          Framebuffer &target, const RowTasks &tasks = {});
    // Draws fast, whatever the quality in `look`.
    RenderStatistics draw_fast(std::span<const PointRun> runs, const Camera &camera, const Look &look,
                               Framebuffer &target, const RowTasks &tasks = {});

    // Draws the same picture for programs that compose pictures: without depth cue, finish and legend, which they can
    // add.
    PictureLayers draw_layers(std::span<const PointRun> runs, const Camera &camera, const Look &look, Motion motion,
                              glm::ivec2 size, RenderStatistics &drawn);

    // Draws a fine picture step by step, see FineRenderer; `target` of `begin_fine` gives the size of pictures, and has
    // depths.
    void begin_fine(std::span<const PointRun> runs, const Camera &camera, const Look &look, const Framebuffer &target);
    // Adds samples and fills `target` with the mean of all so far. Once `stop` is set it returns early; the picture
    // must then begin anew.
    RenderStatistics add_samples(int count, Framebuffer &target, const std::atomic<bool> *stop = nullptr);

  private:
    ThreadPool &pool();
    FastRenderer &fast(const Appearance &appearance);
    FineRenderer &fine(const Appearance &appearance);
    // Calls `draw` with a picture that has depths if the depth cue needs them, and adds the cue to `target`.
    template <class Draw>
    RenderStatistics with_depth_cue(const Camera &camera, DepthCue cue, Framebuffer &target, const Draw &draw);
    // The appearance of a picture, with the colours of a field if the points show one.
    Appearance appearance(const Look &look) const;
    // Grades the picture that the fine renderer has drawn.
    void grade_samples(const Finish &finish, Framebuffer &picture) const;
    // Adds to a picture what comes after the depth cue: the rest of its finish, and the legend.
    void complete(const LookOptions &look, const Camera &camera, Framebuffer &target) const;

    const StreamedScene &scene_;
    const std::optional<Legend> legend_;
    const int threads_;
    std::shared_ptr<ThreadPool> pool_; // created on first use
    std::optional<FastRenderer> fast_; // created on first use
    std::optional<FineRenderer> fine_;
    std::optional<Appearance> fast_appearance_, fine_appearance_; // last set in the renderers
    std::optional<Framebuffer> depths_;                           // used if the target has no depths
    Camera fine_camera_;
    DepthCue fine_cue_ = DepthCue::none;
    LookOptions fine_look_;
};

// Adds the background if `look` has a finish, and the scale bar.
void add_rest_of_finish(const LookOptions &look, const Camera &camera, Unit unit, Framebuffer &target);

// Adds the depth cue to a picture that `camera` took of a grid with this edge.
void add_depth_cue(DepthCue cue, const Camera &camera, double grid_edge, ThreadPool &pool, Framebuffer &target);

} // namespace pbm
