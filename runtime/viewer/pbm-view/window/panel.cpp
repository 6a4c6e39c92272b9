#include "window/panel.h"

#include "pbm_render/camera/camera.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec3.hpp>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace pbm {
namespace {

constexpr float kWidth = 330, kItemWidth = 170, kMargin = 12; // pixels at scale 1
constexpr float kSteepest = 89;                               // degrees; vertical light has no azimuth

std::array<float, 3> to_floats(Rgb8 colour) {
    return {static_cast<float>(colour[0]) / 255, static_cast<float>(colour[1]) / 255,
            static_cast<float>(colour[2]) / 255};
}

std::uint8_t to_byte(float part) { return static_cast<std::uint8_t>(std::lround(std::clamp(part, 0.0F, 1.0F) * 255)); }

bool edit_colour(const char *label, Rgb8 &colour) {
    std::array<float, 3> parts = to_floats(colour);
    if (!ImGui::ColorEdit3(label, parts.data(), ImGuiColorEditFlags_NoInputs))
        return false;
    for (std::size_t i = 0; i < 3; ++i)
        colour[i] = to_byte(parts[i]);
    return true;
}

// Conversion between linear light and sRGB, 0..1. IEC 61966-2-1
float encoded(float linear) {
    return linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
}
float linear(float encoded) {
    return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

// Edits an intensity as its largest component and a colour.
bool edit_intensity(std::array<float, 3> &intensity) {
    float strength = *std::max_element(intensity.begin(), intensity.end());
    std::array<float, 3> colour{1, 1, 1};
    if (strength > 0)
        for (std::size_t i = 0; i < 3; ++i)
            colour[i] = encoded(intensity[i] / strength);
    const bool stronger = ImGui::SliderFloat("Intensity", &strength, 0, 4, "%.2f");
    ImGui::SameLine();
    if (!ImGui::ColorEdit3("##colour", colour.data(), ImGuiColorEditFlags_NoInputs) && !stronger)
        return false;
    for (std::size_t i = 0; i < 3; ++i)
        intensity[i] = std::max(0.0F, strength) * linear(colour[i]);
    return true;
}

struct Stop {
    float at;
    Rgb8 colour;
};
struct Preset {
    const char *name;
    std::vector<Stop> stops; // from 0 to 1, sRGB
};

const std::vector<Preset> &presets() {
    static const std::vector<Preset> kPresets{
        {"White marble", {{0, {70, 72, 84}}, {0.35F, {176, 176, 182}}, {0.7F, {232, 230, 226}}, {1, {250, 248, 244}}}},
        {"Green marble", {{0, {10, 28, 20}}, {0.5F, {34, 82, 56}}, {0.8F, {120, 160, 130}}, {1, {222, 232, 220}}}},
        {"Red marble", {{0, {52, 10, 10}}, {0.5F, {136, 44, 38}}, {0.8F, {196, 118, 100}}, {1, {240, 220, 206}}}},
        {"Oak", {{0, {116, 72, 34}}, {0.5F, {170, 118, 66}}, {1, {212, 166, 108}}}},
        {"Walnut", {{0, {44, 26, 16}}, {0.5F, {84, 54, 34}}, {1, {128, 90, 58}}}},
        {"Greys", {{0, {0, 0, 0}}, {1, {255, 255, 255}}}}};
    return kPresets;
}

std::array<Rgb8, 256> palette_of(const std::vector<Stop> &stops) {
    std::array<Rgb8, 256> palette{};
    std::size_t stop = 0;
    for (std::size_t i = 0; i < palette.size(); ++i) {
        const float at = static_cast<float>(i) / 255;
        while (stop + 2 < stops.size() && at > stops[stop + 1].at)
            ++stop;
        const Stop &from = stops[stop], &to = stops[stop + 1];
        const float part = (at - from.at) / (to.at - from.at);
        for (std::size_t c = 0; c < 3; ++c)
            palette[i][c] = to_byte(
                ((1 - part) * static_cast<float>(from.colour[c]) + part * static_cast<float>(to.colour[c])) / 255);
    }
    return palette;
}

bool edit_palette(const char *label, std::array<Rgb8, 256> &palette, const std::array<Rgb8, 256> &of_file) {
    const char *shown = palette == of_file ? "As in the file" : "Custom";
    for (const Preset &preset : presets())
        if (palette != of_file && palette == palette_of(preset.stops))
            shown = preset.name;
    bool changed = false;
    if (ImGui::BeginCombo(label, shown)) {
        const auto offer = [&](const char *name, const std::array<Rgb8, 256> &colours) {
            if (ImGui::Selectable(name, palette == colours)) {
                palette = colours;
                changed = true;
            }
        };
        offer("As in the file", of_file);
        for (const Preset &preset : presets())
            offer(preset.name, palette_of(preset.stops));
        ImGui::EndCombo();
    }
    return changed;
}

bool edit_switch(const char *label, bool &on, bool there) {
    ImGui::BeginDisabled(!there);
    const bool changed = ImGui::Checkbox(label, &on);
    ImGui::EndDisabled();
    return changed;
}

std::string title(std::string what, std::size_t index, std::size_t count) {
    if (count > 1)
        what.append(" ").append(std::to_string(index + 1));
    return what;
}

bool build_switches(const ModelParameters &file, bool has_panorama, RenderOptions &options) {
    const bool textured_ground = file.ground && file.ground->texture;
    bool changed = edit_switch("Texture", options.texture, !file.texture.empty() || textured_ground);
    changed |= edit_switch("Point colours", options.point_colours, file.attributes.colour != ColourFormat::none);
    changed |= edit_switch("Shadows", options.shadows, file.attributes.lights > 0);
    changed |= edit_switch("Panorama", options.panorama, has_panorama);
    changed |= edit_switch("Ground plane", options.ground, file.ground.has_value());
    changed |= edit_switch("Reflections", options.reflections, has_panorama);
    return changed;
}

bool build_quality(LookOptions &options) {
    bool changed = false;
    bool fine = draws_fine(options.quality, Motion::still);
    if (ImGui::Checkbox("Fine at rest", &fine)) {
        options.quality = fine ? Quality::automatic : Quality::fast;
        changed = true;
    }
    ImGui::BeginDisabled(!fine);
    changed |= ImGui::SliderInt("Samples", &options.samples, 1, 64, "%d", ImGuiSliderFlags_AlwaysClamp);
    ImGui::EndDisabled();
    int cue = static_cast<int>(options.depth_cue);
    if (ImGui::Combo("Depth cue", &cue, "none\0eye-dome\0ambient occlusion\0")) {
        options.depth_cue = static_cast<DepthCue>(cue);
        changed = true;
    }
    Rgba8 &colour = options.render.background;
    Rgb8 background{colour[0], colour[1], colour[2]};
    if (edit_colour("Background", background)) {
        std::copy(background.begin(), background.end(), colour.begin());
        changed = true;
    }
    return changed;
}

// Edits the direction that the light comes from, seen from the front: degrees to the right, and up.
bool build_direction(UpAxis up_axis, Light &light) {
    const glm::dvec3 up = up_direction(up_axis), front = front_direction(up_axis);
    const glm::dvec3 right = glm::cross(up, front);
    const glm::dvec3 from = -glm::dvec3(light.direction[0], light.direction[1], light.direction[2]);
    auto azimuth = static_cast<float>(glm::degrees(std::atan2(glm::dot(from, right), glm::dot(from, front))));
    auto height = static_cast<float>(glm::degrees(std::asin(std::clamp(glm::dot(from, up), -1.0, 1.0))));
    bool changed = ImGui::SliderFloat("To the right", &azimuth, -180, 180, "%.0f deg");
    changed |= ImGui::SliderFloat("Height", &height, -kSteepest, kSteepest, "%.0f deg");
    if (!changed)
        return false;
    const double a = glm::radians(static_cast<double>(azimuth));
    const double h = glm::radians(static_cast<double>(std::clamp(height, -kSteepest, kSteepest)));
    const glm::dvec3 direction =
        -glm::normalize(std::cos(h) * (std::sin(a) * right + std::cos(a) * front) + std::sin(h) * up);
    for (int i = 0; i < 3; ++i)
        light.direction[static_cast<std::size_t>(i)] = static_cast<float>(direction[i]);
    return true;
}

bool build_light(const ModelParameters &file, Light &light, std::size_t index, std::size_t count) {
    constexpr std::array<const char *, 3> kKinds{"Directional light", "Point light", "Spot light"};
    ImGui::TextUnformatted(title(kKinds[static_cast<std::size_t>(light.kind)], index, count).c_str());
    bool changed = edit_intensity(light.intensity);
    if (light.kind != LightKind::point)
        changed |= build_direction(file.grid.up, light);
    if (light.kind != LightKind::directional) {
        const auto edge = static_cast<float>(file.grid.edge());
        changed |= ImGui::DragFloat3("Position", light.position.data(), edge / 500, 0, 0, "%.4g");
    }
    if (light.kind == LightKind::spot)
        changed |= ImGui::SliderFloat("Exponent", &light.exponent, 0, 128, "%.1f");
    const bool baked = index < file.lights.size() && static_cast<int>(index) < file.attributes.lights;
    const Light &of_file = baked ? file.lights[index] : light;
    if (of_file.direction != light.direction || of_file.position != light.position)
        ImGui::TextWrapped("Its shadows were baked for another place: pbm-build makes them anew.");
    return changed;
}

bool build_lights(const ModelParameters &file, Appearance &appearance) {
    bool changed = false;
    for (std::size_t i = 0; i < appearance.lights.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        changed |= build_light(file, appearance.lights[i], i, appearance.lights.size());
        ImGui::PopID();
    }
    return changed;
}

bool build_materials(bool has_panorama, Appearance &appearance) {
    bool changed = false;
    for (std::size_t i = 0; i < appearance.materials.size(); ++i) {
        Material &material = appearance.materials[i];
        const auto edit = [&](const char *label, float &value) {
            changed |= ImGui::SliderFloat(label, &value, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp);
        };
        ImGui::PushID(static_cast<int>(100 + i));
        ImGui::TextUnformatted(title("Material", i, appearance.materials.size()).c_str());
        ImGui::SameLine();
        changed |= edit_colour("##colour", material.colour);
        edit("Ambient", material.ka);
        edit("Diffuse", material.kd);
        edit("Specular", material.ks);
        changed |= ImGui::SliderFloat("Power", &material.power, 1, 1024, "%.0f",
                                      ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
        ImGui::BeginDisabled(!has_panorama);
        edit("Reflection", material.environment);
        ImGui::EndDisabled();
        ImGui::PopID();
    }
    return changed;
}

bool build_palettes(const ModelParameters &file, Appearance &appearance) {
    bool changed = false;
    if (!file.texture.empty())
        changed = edit_palette("Palette", appearance.palette, file.texture.front().palette);
    if (file.ground && file.ground->texture)
        changed |= edit_palette("Ground", appearance.ground_palette, file.ground->texture->palette);
    return changed;
}

} // namespace

void Panel::show_model(const ModelParameters &file, bool has_panorama, const Look &first) {
    file_ = &file;
    has_panorama_ = has_panorama;
    first_ = first;
}

bool Panel::build(Look &look, glm::ivec2 size, float scale) {
    const ImGuiCond place = size == size_ ? ImGuiCond_Once : ImGuiCond_Always;
    size_ = size;
    const auto width = static_cast<float>(size.x), height = static_cast<float>(size.y), margin = kMargin * scale;
    const float own_width = std::clamp(width - 2 * margin, 1.0F, kWidth * scale);
    ImGui::SetNextWindowPos({width - own_width - margin, margin}, place);
    ImGui::SetNextWindowSizeConstraints({own_width, 0}, {own_width, std::max(1.0F, height - 2 * margin)});
    bool changed = false;
    if (ImGui::Begin("Shading (Tab)", nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings)) {
        ImGui::PushItemWidth(kItemWidth * scale);
        // Build every part, even if an earlier one reports a change.
        changed = build_switches(*file_, has_panorama_, look.options.render);
        changed = build_quality(look.options) || changed;
        if (ImGui::CollapsingHeader("Lights"))
            changed = build_lights(*file_, look.appearance) || changed;
        if (ImGui::CollapsingHeader("Materials"))
            changed = build_materials(has_panorama_, look.appearance) || changed;
        changed = build_palettes(*file_, look.appearance) || changed;
        if (ImGui::Button("Reset")) {
            look = *first_;
            changed = true;
        }
        ImGui::PopItemWidth();
    }
    ImGui::End();
    return changed;
}

} // namespace pbm
