// Named looks for people who know no lights: sets of options.
#pragma once

#include "viewer/options/view_options.h"

#include <string>
#include <vector>

namespace pbm {

//   plate   a plate of a catalogue: white background, soft shadow, parallel projection, scale bar, for print
//   hero    studio lights with a panorama and a ground, which scans are built with
//   clay    no colours, crevices darkened
//   raking  light that grazes the picture's plane from the upper left, at an angle
enum class PresetKind { plate, hero, clay, raking };

struct Preset {
    PresetKind kind = PresetKind::plate;
    double angle = 15; // of raking light, degrees
};
// "plate", "hero", "clay", "raking" or "raking,ANGLE".
//
// errors  usage
Result<Preset> parse_preset(const std::string &text);

// Sets the options that the preset stands for; options that are stored later win.
void set_preset(const Preset &preset, ViewOptions &view);
// The options of pbm-build that it stands for, for scans.
std::vector<std::string> build_options(const Preset &preset);

} // namespace pbm
