// The fine renderer, for still pictures: blends points into a smooth surface, shades every pixel separately, and takes
// several samples per pixel for soft edges.
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002; Zwicker,
// Pfister, van Baar, Gross. EWA Splatting. 2002; Botsch, Spernat, Kobbelt. Phong Splatting. 2004; Botsch, Hornung,
// Zwicker, Kobbelt. High-Quality Surface Splatting on Today's GPUs. 2005
//
// Every point moves by its surface offset (SurfaceOffsets). The renderer draws a sample at the centres of all pixels,
// and then others, each shifted by a fraction of a pixel, of those pixels where the picture changes (SampleSums), strip
// by strip:
//
//   visibility   draws splats into the z-buffer: covered pixels and their depths
//   blending     draws larger, soft splats: those near the visible surface add normal, colour and lit fractions
//   shading      computes Phong reflection and mirrored light once per pixel, with the blended normal
//
// The result is the mean of the samples in linear light, alpha included; of a pixel with one sample, that sample
// corrected by the curvature of the light around it.
//
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/point_run.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "system/threads/thread_pool.h"

#include <atomic>
#include <memory>
#include <span>

namespace pbm {

class Surroundings; // pbm_render/surroundings/surroundings.h

inline constexpr int kDefaultSamples = 8, kMaxSamples = 256; // per pixel; the largest number that programs offer

class FineRenderer {
  public:
    // `parameters` must outlive the renderer. `chunk_points` is that of the file's header. `threads`: 0 asks for one
    // per processor. Without `surroundings` the background has one colour.
    FineRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, int threads,
                 std::shared_ptr<const Surroundings> surroundings = nullptr);
    // The same with threads that others use too, but not while this renderer draws.
    FineRenderer(const ModelParameters &parameters, std::uint32_t chunk_points, std::shared_ptr<ThreadPool> pool,
                 std::shared_ptr<const Surroundings> surroundings = nullptr);
    ~FineRenderer();
    FineRenderer(const FineRenderer &) = delete;
    FineRenderer &operator=(const FineRenderer &) = delete;

    // Takes effect with the next picture.
    void set_appearance(Appearance appearance);

    // Draws a picture of `samples` samples per pixel that needs several, 1 or more, into `target`. FastRenderer::render
    // documents cameras, bytes of mapped files, threads and SIMD targets. All runs must have offsets. Depths are those
    // of the first sample, which lies at the centres of the pixels.
    RenderStatistics render(std::span<const PointRun> runs, const Camera &camera, const RenderOptions &options,
                            Framebuffer &target, int samples = kDefaultSamples);

    // Draws the same picture step by step, for a window at rest: after each step the window may show the mean so far or
    // start another picture. The first sample is the dearest. Needs 16 bytes per pixel, 20 with depths.
    //
    //   renderer.begin(runs, camera, options, target);
    //   renderer.add_samples(1);
    //   renderer.resolve(target);
    //   renderer.add_samples(kDefaultSamples - 1);
    //   renderer.resolve(target);
    //
    // The chunks of `runs` must stay resident until the last sample. `target` gives size and presence of depths.
    void begin(std::span<const PointRun> runs, const Camera &camera, const RenderOptions &options,
               const Framebuffer &target);
    // Adds samples; any number may be added, in any number of steps. Once another thread sets `stop` it returns within
    // a few milliseconds, without whole samples: the picture is then lost, and the next call must be `begin`.
    RenderStatistics add_samples(int count, const std::atomic<bool> *stop = nullptr);
    // Number of samples added since `begin`.
    int samples() const;
    // Writes the mean of the samples so far, at least one, to a picture like that of `begin`.
    void resolve(Framebuffer &target);
    // The same in linear light: red, green and blue times alpha, and alpha, [height][width].
    void resolve(std::span<Float4> target) const;

  private:
    struct Frame;
    std::unique_ptr<Frame> frame_;
};

} // namespace pbm
