// Shows the shape of scans without colours. Screen-space shading: darkens pixels that lie deeper than their neighbours.
// Based on: Boucheny. Interactive Scientific Visualization of Large Datasets. 2009 (eye-dome lighting); McGuire, Osman,
// Bukowski, Hennessy. The Alchemy Screen-Space Ambient Obscurance Algorithm. 2011
// Stability: experimental.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/threads/thread_pool.h"

#include <cstdint>

namespace pbm {

enum class DepthCue : std::uint8_t { none, eye_dome, ambient_occlusion };

// Parameters of the view that the z-buffer lacks.
struct DepthCueView {
    double focal;     // pixels
    double grid_edge; // model units; scales the reach of ambient occlusion
    // Scales relative depth differences: distance of the drawn eye from the focal point / distance of the camera from
    // it. It exceeds 1 for telecentric(), so that an orthographic picture is shaded like a perspective one.
    double relief = 1;
};

// Darkens the colours of drawn pixels of `target`, which must have depths. Alpha, depths and empty pixels do not
// change. The picture is the same for any number of threads.
void apply_depth_cue(DepthCue cue, const DepthCueView &view, ThreadPool &pool, Framebuffer &target);

} // namespace pbm
