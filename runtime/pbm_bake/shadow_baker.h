// Bakes the shadows of one light: the lit fraction of every point and of a ground plane, from several shadow maps.
// Based on: Williams. Casting Curved Shadows on Curved Surfaces. 1978; dissertation sections 4.3 and 7.1
//
//   const ShadowCasters casters(model, threads);
//   model.levels.back().points.shadows[0] = bake_light(casters, lights[0], {.maps = 4});
//   model.images.ground_lit = {bake_ground(casters, lights[0], ground, 1024, {.maps = 16})};
//
// The result is the same for any number of threads, SIMD target and compiler.
// Stability: stable.
#pragma once

#include "pbm_bake/shadow_casters.h"
#include "pbm_bake/shadow_rays.h"

#include <atomic>
#include <functional>

namespace pbm {

inline constexpr int kMaxShadowMaps = 255;
inline constexpr int kHardGroundMaps = 16; // that a hard shadow on a ground plane needs for a smooth edge

struct ShadowOptions {
    int maps = 4; // 1..kMaxShadowMaps maps, or rays per point with `rays`; soft shadows need 2^bits or more
    int bits = 1; // of the lit fraction: 1, 2, 4 or 8
    // Diameter of the light in model units, or at distance 1 if it is directional (the sun: 0.0093). 0: hard shadows.
    double light_size = 0;
    // Rays of the same casters. Points use them instead of maps if they are complete.
    const ShadowRays *rays = nullptr;
    int threads = 0;                           // 0: one per processor
    std::function<void(double)> progress = {}; // receives 0..1, one call at a time; may be empty
    const std::atomic<bool> *stop = nullptr;   // another thread sets it to true to stop; the result is then empty
};

// Returns one byte per point of `casters`, 0 (in shadow)..2^bits - 1 (lit): whether something else lies between the
// light and the side of the point that faces it. The back of a point is lit if the model is not closed
// (ModelParameters::closed) or the point is two-sided. Other points that face away, and points behind a spot light, are
// never lit. They get the value of neighbours that face the light, so that averages hold the lit fraction of what can
// be lit, and the stream compresses. `light` obeys BVG.md 3.7. The ground plane casts no shadow.
//
// throws  std::bad_alloc
Bytes bake_light(const ShadowCasters &casters, const Light &light, const ShadowOptions &options = {});

// Returns the lit fraction x 255 of `size` x `size` texels of `ground`, one channel, as ModelImages::ground_lit has it.
// Ignores `options.bits`. Points of the model below the plane cast no shadow on it.
//
// throws  std::bad_alloc
Image bake_ground(const ShadowCasters &casters, const Light &light, const GroundPlane &ground, std::uint32_t size,
                  const ShadowOptions &options = {});

// Lit fractions of all detail levels from those of the finest one. BVG.md 7.8
//
// `masks`: the octree, [depth + 1]. `bits`: of a lit fraction at each level, 1, 2, 4 or 8. `finest`: 0..2^bits - 1 of
// each point. Returns [depth + 1][points of the level]: the means that a file stores, scaled to 0..255.
//
// throws  std::bad_alloc
std::vector<Bytes> lit_levels(const LevelMasks &masks, std::span<const std::uint8_t> bits, ByteView finest);

} // namespace pbm
