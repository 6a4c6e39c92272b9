// Shows the shape of scans without colours: darkens what lies deeper than its surroundings, from the z-buffer alone.
// Based on: Boucheny. Interactive Scientific Visualization of Large Datasets. 2009 (eye-dome lighting);
//           McGuire, Osman, Bukowski, Hennessy. The Alchemy Screen-Space Ambient Obscurance Algorithm. 2011
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/threads/thread_pool.h"

#include <cstdint>

namespace pbm {

enum class DepthCue : std::uint8_t { none, eye_dome, ambient_occlusion };

// What the z-buffer does not say.
struct DepthCueView {
    double focal;     // pixels
    double grid_edge; // model units; ambient occlusion looks a part of it around
};

// Darkens the colours of `target`, which has depths, where something was drawn. Leaves alpha, depths and what is empty
// as they are. Same picture for any number of threads.
void apply_depth_cue(DepthCue cue, const DepthCueView &view, ThreadPool &pool, Framebuffer &target);

} // namespace pbm
