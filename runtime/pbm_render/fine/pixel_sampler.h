// Draws and blends points into several samples of chosen pixels at once. SIMD (Highway); the sums are the same on every
// target.
#pragma once

#include "pbm_render/fine/sampled_pixels.h"
#include "pbm_render/fine/strip_points.h"
#include "pbm_render/splats/depth_strip.h"

namespace pbm {

// Draws points as ellipses into `pixels.visible`. `strip` has the rows of the pixels; its depths are not used.
// `hiding`: [pixels] depths behind which nothing is visible, or null.
void draw_samples(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                  const SampledPixels::Offsets &offsets, const float *hiding, SampledPixels &pixels);

// Fronts or backs of SampledPixels.
struct BlendedSide {
    const float *depth, *farthest;
};

// Blends points into `pixels.sums` where the depths of `side` are near. Accesses stay in bounds if the bytes of a
// mapped chunk change.
void blend_samples(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                   const SurfacePoints &looks, const SampledPixels::Offsets &offsets, const BlendedSide &side,
                   SampledPixels &pixels);

} // namespace pbm
