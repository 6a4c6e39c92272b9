// Draws the visible surface, then blends the points of bricks into it: each adds its look to the pixels around it where
// the surface is near its plane, weighted by distance. SIMD (Highway); the sums are the same on every target.
// Based on: Zwicker, Pfister, van Baar, Gross. EWA Splatting. 2002 (soft ellipses, low-pass); Botsch, Wiratanaya,
// Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002 (visibility, then blending)
#pragma once

#include "pbm_render/fine/sampled_pixels.h"
#include "pbm_render/fine/strip_points.h"
#include "pbm_render/fine/surface_buffer.h"
#include "pbm_render/fine/surface_points.h"
#include "pbm_render/splats/depth_strip.h"
#include "pbm_render/splats/farthest_depths.h"

#include <span>

namespace pbm {

// The weight of a soft splat at distance d from its middle is (1 - (d / r)^2)^2 for d < r, else 0; r is kKernelRadius
// times the splat radius. It is close to a Gaussian of deviation r / 2.
inline constexpr float kKernelRadius = 2.0F;
// Low-pass filter in pixels: replaces the radius r of an ellipse by sqrt(r^2 + kLowPass^2).
inline constexpr float kLowPass = 1.0F;
// Largest distance between a splat's plane and the visible surface, in splat radii, along the normal. The weight falls
// from half of that distance on.
inline constexpr float kBlendBand = 0.75F;
// Lower bound of the cosine that converts that distance to a difference of depths.
inline constexpr float kBandCosine = 0.25F;

// All functions below expect runs with surface offsets.

// Draws the fronts of the bricks in `seen` that touch the strip's rows, every point as an ellipse. The bounds of bricks
// must include those of soft splats, see make_bricks_soft. Point i of the chunk has the id `first_id` + i. Appends the
// points that face the eye to `fronts`, and the points of the same bricks that face away to `backs`. Returns the number
// of points; each point counts in one strip only.
std::uint64_t draw_fronts(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip, StripPoints &fronts, StripPoints &backs);

// Appends the points of bricks without fronts to `backs`, except bricks that `farthest` hides. `farthest` must be begun
// for the strip after all fronts are drawn. Returns the number of points; each point counts in one strip only.
std::uint64_t add_backs(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                        std::uint32_t first_id, const DepthStrip &strip, FarthestDepths &farthest, StripPoints &backs);

// Appends the points of the bricks in `seen` whose soft splats may reach chosen pixels of the strip, whose depths are
// not used.
void find_points(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                 std::uint32_t first_id, const DepthStrip &strip, const ChosenCounts &chosen, StripPoints &fronts,
                 StripPoints &backs);

// Draws the backs that may be visible as ellipses, and removes the others. `farthest`: as for add_backs.
void draw_and_keep_visible(const FrameGeometry &frame, StripPoints &backs, FarthestDepths &farthest, DepthStrip &strip);

// Blends points into `surface`, which has the strip's depths. Accesses stay in bounds if the bytes of a mapped chunk
// change.
void blend_points(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                  const SurfacePoints &looks, SurfaceBuffer &surface);

// Upper bound of the distance between two points of a brick, voxel edges.
inline constexpr float kBrickReach = 12.2F;

// Makes all bricks draw ellipses (VisibleBrick::block = 0), and computes their bounds as soft splats.
void make_bricks_soft(const FrameGeometry &frame, const RunGeometry &run, std::span<VisibleBrick> seen);

} // namespace pbm
