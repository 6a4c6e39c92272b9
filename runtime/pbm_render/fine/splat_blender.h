// Blends the points of bricks into the visible surface: each adds what it looks like to the pixels around it, the more
// the nearer, if the surface that is seen there passes near its plane. Before that, draws what is visible. SIMD
// (Highway); the same sums on every target.
// Based on: Zwicker, Pfister, van Baar, Gross. EWA Splatting. 2002 (soft ellipses, low-pass); Botsch, Wiratanaya,
//           Kobbelt 2002 (visibility first, then blending within a depth band)
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/fine/surface_buffer.h"
#include "pbm_render/fine/surface_points.h"

#include <span>

namespace pbm {

// A soft splat's weight is (1 - (d / r)^2)^2 at distance d from its middle, close to a Gaussian of deviation r / 2 but
// with an end: r is this multiple of the splat's radius.
inline constexpr float kKernelRadius = 2.0F;
// Low-pass: its radii become the hypotenuses of themselves and so many pixels.
inline constexpr float kLowPass = 1.0F;
// A splat's plane and the visible surface may be so far from each other, in splat radii, measured across the plane;
// from half of that on the splat counts less.
inline constexpr float kBlendBand = 0.75F;
// Planes that are seen at a flatter angle than with this cosine allow no larger difference of depths.
inline constexpr float kBandCosine = 0.25F;

// The runs have offsets.

// Draws what is visible: those of the run's `seen` bricks that touch the strip, every point as an ellipse. The id of
// point i of the chunk is `first_id` + i. Returns how many points were drawn, each counted in one strip.
std::uint64_t draw_visible(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                           std::uint32_t first_id, DepthStrip &strip);

// Adds those of the run's `seen` bricks that touch the rows of `strip` to `surface`, which has its depths. The bricks'
// rows must count soft splats in: widen_bricks. In bounds whatever the bytes of a mapped chunk became.
void blend_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                  const DepthStrip &strip, const SurfacePoints &points, SurfaceBuffer &surface);

// No point of a brick is farther from the first one than this, voxel edges.
inline constexpr float kBrickReach = 12.2F;

// What find_seen_bricks found, for renderers that draw every point as an ellipse, with rows for soft splats.
void widen_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<SeenBrick> seen);

} // namespace pbm
