// Drawing options: those of every renderer, and the viewer's own.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/appearance/field_colours.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/shading/depth_cue.h"

#include <cstdint>
#include <optional>
#include <string>

namespace pbm {

// fast: FastRenderer; fine: FineRenderer; automatic: fine for pictures at rest, fast for moving ones.
enum class Quality : std::uint8_t { automatic, fast, fine };

// still: a picture of its own, or of a window at rest. moving: one of many, of a video, a bench or a window in motion.
enum class Motion : std::uint8_t { still, moving };

constexpr bool draws_fine(Quality quality, Motion motion) {
    return quality == Quality::fine || (quality == Quality::automatic && motion == Motion::still);
}

// One light that follows the camera. Where it comes from: degrees to the right of the eye and above it.
struct Headlight {
    double right = 0, up = 0;
    bool operator==(const Headlight &) const = default;
};

// Draw the points in the colours of a field of the file.
struct ColourBy {
    std::string field;
    ColourChoice choice;
    bool if_there = false; // a model without the field is drawn in its own colours; else it is refused
    bool operator==(const ColourBy &) const = default;
};

struct LookOptions {
    RenderOptions render;
    Quality quality = Quality::automatic;
    int samples = kDefaultSamples; // per pixel of fine pictures, 1..kMaxSamples
    DepthCue depth_cue = DepthCue::none;
    std::optional<LightsFollow> lights_follow; // default: as Appearance has them
    std::optional<Headlight> headlight;        // in place of all other lights
    std::optional<ColourBy> colour_by;         // of models that are opened from now on
    bool legend = true;                        // of these colours
};

// The look with the quality that such pictures are drawn with: fast or fine.
inline LookOptions look_of(Motion motion, LookOptions look) {
    look.quality = draws_fine(look.quality, motion) ? Quality::fine : Quality::fast;
    return look;
}

} // namespace pbm
