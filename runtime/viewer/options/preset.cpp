#include "viewer/options/preset.h"

#include <glm/trigonometric.hpp>

#include <charconv>
#include <cmath>

namespace pbm {
namespace {

constexpr double kLeastAngle = 1, kMostAngle = 60; // of raking light, degrees

Rgba8 grey(std::uint8_t shade) { return {shade, shade, shade, 255}; }

// From the upper left, at this angle to the plane of the picture.
Headlight grazing(double angle) {
    const double depth = std::sin(glm::radians(angle)), aside = std::cos(glm::radians(angle)) / std::sqrt(2.0);
    return {.right = glm::degrees(std::atan2(-aside, depth)), .up = glm::degrees(std::asin(aside))};
}

void set_plate(ViewOptions &view) {
    constexpr int kDpi = 300, kWidth = 1800, kHeight = 2400; // 152 x 203 mm
    view.resolution = {kWidth, kHeight};
    view.orthographic = true;
    view.look.render.background = grey(255);
    view.look.render.panorama = view.look.render.ground = false;
    view.look.finish = {.drop_shadow = true, .scale_bar = true, .dpi = kDpi};
}

void set_hero(ViewOptions &view) {
    view.look.render.background = grey(92);
    view.look.render.background_below = grey(28);
    view.look.finish.tone = Tone::filmic;
    view.look.finish.exposure = 0.5;
}

void set_clay(ViewOptions &view) {
    view.look.render.point_colours = view.look.render.texture = view.look.render.panorama = false;
    view.look.render.background = grey(235);
    view.look.render.background_below = grey(190);
    view.look.depth_cue = DepthCue::ambient_occlusion;
}

void set_raking(double angle, ViewOptions &view) {
    view.look.render.background = grey(0);
    view.look.render.panorama = view.look.render.ground = false;
    view.look.headlight = grazing(angle);
    view.look.finish.exposure = 0.5;
}

} // namespace

Result<Preset> parse_preset(const std::string &text) {
    constexpr std::string_view kRaking = "raking,";
    if (text == "plate")
        return Preset{PresetKind::plate};
    if (text == "hero")
        return Preset{PresetKind::hero};
    if (text == "clay")
        return Preset{PresetKind::clay};
    if (text == "raking")
        return Preset{PresetKind::raking};
    if (text.starts_with(kRaking)) {
        Preset preset{PresetKind::raking};
        const char *const end = text.data() + text.size();
        const auto [at, error] = std::from_chars(text.data() + kRaking.size(), end, preset.angle);
        if (error == std::errc() && at == end && preset.angle >= kLeastAngle && preset.angle <= kMostAngle)
            return preset;
    }
    return usage_error("'" + text + "' is no preset; write plate, hero, clay, raking or raking,15 (1 to 60 degrees)");
}

void set_preset(const Preset &preset, ViewOptions &view) {
    switch (preset.kind) {
    case PresetKind::plate: return set_plate(view);
    case PresetKind::hero: return set_hero(view);
    case PresetKind::clay: return set_clay(view);
    case PresetKind::raking: return set_raking(preset.angle, view);
    }
}

std::vector<std::string> build_options(const Preset &preset) {
    if (preset.kind != PresetKind::hero)
        return {};
    return {"--lights=studio", "--shadows", "--ground=plain", "--panorama=default"};
}

} // namespace pbm
