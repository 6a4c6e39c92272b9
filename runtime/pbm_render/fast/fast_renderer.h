// The renderer that is fast: bricks are culled, their points projected and drawn with SIMD into strips of the picture
// that stay in the cache; only what is seen is shaded. Shows what the reference renderer shows.
// Based on: Rusinkiewicz, Levoy. QSplat. 2000 (level by projected size, normal cones); Zwicker, Pfister, van Baar,
//           Gross. EWA Splatting. 2002 (the shape of a splat, see splat.h)
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/bricks/point_run.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/picture/render_options.h"
#include "pbm_render/surroundings/surroundings.h"

#include <memory>
#include <span>

namespace pbm {

class FastRenderer {
  public:
    // `parameters` must stay as long as the renderer. `chunk_points` bounds the points of a chunk (the file's header
    // says it). `threads`: 0 asks for one per processor. Without `surroundings` there is only the background colour.
    FastRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, int threads,
                 std::shared_ptr<const Surroundings> surroundings = nullptr);
    ~FastRenderer();
    FastRenderer(const FastRenderer &) = delete;
    FastRenderer &operator=(const FastRenderer &) = delete;

    // From the next frame on: the tables of a frame are all that depends on it.
    void set_appearance(Appearance appearance);

    // Draws one frame into `target`, whatever was there before, and its depths if it has any: of object and ground, the
    // panorama has none. The camera must be usable. The chunks of `runs` were proven; a mapped file whose bytes change
    // afterwards spoils the picture and nothing else. Runs may have offsets, which the first frame that shows them
    // estimates. Of more than 2^32 / `chunk_points` runs, more than any model has, those behind are not drawn. Same
    // picture for any number of threads and any SIMD target. Not for several threads at once.
    RenderStatistics render(std::span<const PointRun> runs, const Camera &camera, const RenderOptions &options,
                            Framebuffer &target);

  private:
    struct Frame;
    std::unique_ptr<Frame> frame_;
};

} // namespace pbm
