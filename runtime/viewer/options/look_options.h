// Drawing options: those of every renderer, and the viewer's own.
#pragma once

#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/picture/render_options.h"
#include "pbm_render/shading/depth_cue.h"

#include <cstdint>

namespace pbm {

// fast: FastRenderer; fine: FineRenderer.
enum class Quality : std::uint8_t { fast, fine };

struct LookOptions {
    RenderOptions render;
    Quality quality = Quality::fast;
    int samples = kDefaultSamples; // per pixel of fine pictures, 1..kMaxSamples
    DepthCue depth_cue = DepthCue::none;
};

} // namespace pbm
