// Drawing options: those of every renderer, and the viewer's own.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/appearance/field_colours.h"
#include "pbm_render/appearance/hidden_classes.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/shading/depth_cue.h"
#include "viewer/finish/finish.h"

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

// Draw the points in the colours of a field of the file, or of what every model has.
struct ColourBy {
    std::string field; // as choose_field_colours takes it
    ColourChoice choice;
    bool if_there = false; // a model without the field is drawn as if nobody had asked; else it is refused
    bool operator==(const ColourBy &) const = default;
};

// Points of these classes are drawn.
struct DrawnClasses : ClassChoice {
    bool if_there = false; // a model without classes is drawn as it is; else it is refused
    bool operator==(const DrawnClasses &) const = default;
};

struct LookOptions {
    RenderOptions render;
    Finish finish;
    Quality quality = Quality::automatic;
    int samples = kDefaultSamples;             // per pixel of fine pictures, 1..kMaxSamples
    std::optional<DepthCue> depth_cue;         // default: that of unasked_look
    std::optional<LightsFollow> lights_follow; // default: as Appearance has them
    std::optional<Headlight> headlight;        // in place of all other lights
    std::optional<ColourBy> colour_by;         // of models that are opened from now on; default: as for depth_cue
    bool legend = true;                        // of these colours
    DrawnClasses classes;                      // of models that are opened from now on
};

// Asks for these colours where a model has them.
inline void colour_by(const std::string &name, LookOptions &look) {
    look.colour_by = ColourBy{.field = name, .choice = {}, .if_there = true};
    look.render.texture = look.render.point_colours = true;
}

// The look with the quality that such pictures are drawn with: fast or fine.
inline LookOptions look_of(Motion motion, LookOptions look) {
    look.quality = draws_fine(look.quality, motion) ? Quality::fine : Quality::fast;
    return look;
}

} // namespace pbm
