#include "viewer/pbm-view/window/panel.h"

#include "viewer/pbm-view/window/view_text.h"

#include "pbm_format/model/las_classes.h"
#include "pbm_format/model/material_presets.h"
#include "pbm_render/appearance/field_choice.h"

#include <glm/trigonometric.hpp>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace pbm {
namespace {

constexpr float kWidth = 330, kItemWidth = 170, kMargin = 12; // pixels at scale 1
constexpr float kMaxShare = 0.4F;                             // of the window's width for a docked panel
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

// A switch of what the file has; what it lacks is added to `lacking`.
bool edit_switch(const char *label, bool &on, bool there, std::string &lacking) {
    if (there)
        return ImGui::Checkbox(label, &on);
    std::string word = label;
    word[0] = static_cast<char>(word[0] - 'A' + 'a');
    (lacking += lacking.empty() ? "" : ", ") += word;
    return false;
}

bool build_switches(const ModelParameters &file, bool has_panorama, RenderOptions &options) {
    const bool textured_ground = file.ground && file.ground->texture;
    std::string lacking;
    const auto edit = [&](const char *label, bool &on, bool there) { return edit_switch(label, on, there, lacking); };
    bool changed = edit("Texture", options.texture, !file.texture.empty() || textured_ground);
    changed |= edit("Point colours", options.point_colours, file.attributes.colour != ColourFormat::none);
    changed |= edit("Shadows", options.shadows, file.attributes.lights > 0);
    changed |= edit("Panorama", options.panorama, has_panorama);
    changed |= edit("Ground plane", options.ground, file.ground.has_value());
    changed |= edit("Reflections", options.reflections, has_panorama);
    if (!lacking.empty())
        ImGui::TextWrapped("The file has no %s.", lacking.c_str());
    return changed;
}

bool build_quality(Look &look) {
    LookOptions &options = look.options;
    bool changed = false;
    bool fine = draws_fine(options.quality, Motion::still);
    if (ImGui::Checkbox("Fine at rest", &fine)) {
        options.quality = fine ? Quality::automatic : Quality::fast;
        changed = true;
    }
    if (fine)
        changed |= ImGui::SliderInt("Samples", &options.samples, 1, kMaxSamples, "%d", ImGuiSliderFlags_AlwaysClamp);
    int shading = static_cast<int>(options.render.shading);
    if (ImGui::Combo("Light", &shading, "automatic\0lit\0none: colours alone\0")) {
        options.render.shading = static_cast<Shading>(shading);
        changed = true;
    }
    constexpr float kMostStops = 4;
    auto stops = static_cast<float>(options.finish.exposure);
    if (ImGui::SliderFloat("Exposure", &stops, -kMostStops, kMostStops, "%+.1f stops", ImGuiSliderFlags_AlwaysClamp)) {
        options.finish.exposure = static_cast<double>(stops);
        changed = true;
    }
    int cue = static_cast<int>(look.depth_cue());
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

// What the points are coloured by.
bool build_colours(const ModelParameters &file, LookOptions &options) {
    const std::string shown = options.colour_by ? options.colour_by->field : "as in the file";
    bool changed = false;
    if (ImGui::BeginCombo("Colours", shown.c_str())) {
        if (ImGui::Selectable("as in the file", !options.colour_by) && options.colour_by) {
            options.colour_by = std::nullopt;
            changed = true;
        }
        for (const std::string &name : colour_names(file))
            if (ImGui::Selectable(name.c_str(), shown == name) && shown != name) {
                colour_by(name, options);
                changed = true;
            }
        ImGui::EndCombo();
    }
    return ImGui::Checkbox("Legend", &options.legend) || changed;
}

// A switch for each class, where the points have the colours of their classes.
bool build_classes(const ModelParameters &file, const FieldColours &colours, DrawnClasses &classes) {
    const Field *const field = find_field(file.fields, "class");
    if (colours.map != ColourMap::classes || field != file.fields.data() + colours.field)
        return false;
    bool changed = false;
    for (const std::uint32_t stored : colours.labels) {
        const double number = std::round(field->value(stored));
        if (!(number >= 0 && number < static_cast<double>(classes.dropped.size())))
            continue;
        const auto label = static_cast<std::uint32_t>(number);
        bool is_drawn = !classes.dropped[label] && (!classes.shown || (*classes.shown)[label]);
        const std::string text = std::to_string(label) + ' ' + std::string(class_name(label));
        if (!ImGui::Checkbox(text.c_str(), &is_drawn))
            continue;
        changed = true;
        classes.dropped[label] = !is_drawn;
        if (classes.shown && is_drawn)
            classes.shown->set(label);
    }
    return changed;
}

bool edit_angle(const char *label, double &radians, float most) {
    auto degrees = static_cast<float>(glm::degrees(radians));
    if (!ImGui::SliderFloat(label, &degrees, -most, most, "%.0f deg", ImGuiSliderFlags_AlwaysClamp))
        return false;
    radians = glm::radians(static_cast<double>(degrees));
    return true;
}

// Moves the light round the model.
bool edit_place(const ModelParameters &file, const LightFrame &frame, Light &light) {
    LightBearing bearing = bearing_of(light, frame);
    bool moved = edit_angle("To the right", bearing.azimuth, 180);
    moved |= edit_angle("Height", bearing.height, kSteepest);
    if (light.kind != LightKind::directional) {
        auto distance = static_cast<float>(bearing.distance);
        if (ImGui::SliderFloat("Distance", &distance, 0.1F, 20, "%.2f radii", ImGuiSliderFlags_Logarithmic)) {
            bearing.distance = std::max(0.0, static_cast<double>(distance));
            moved = true;
        }
    }
    if (moved)
        light = moved_to(light, frame, bearing);
    if (light.kind == LightKind::directional)
        return moved;
    const auto edge = static_cast<float>(file.grid.edge());
    moved |= ImGui::DragFloat3("Position", light.position.data(), edge / 500, 0, 0, "%.4g");
    if (light.kind == LightKind::spot && ImGui::Button("Aim at the centre")) {
        light = aimed_at_centre(light, frame);
        moved = true;
    }
    return moved;
}

bool edit_lights_follow(Look &look) {
    bool with_eye = look.lights_follow() == LightsFollow::eye;
    if (!ImGui::Checkbox("Lights follow the eye", &with_eye))
        return false;
    const LightsFollow chosen = with_eye ? LightsFollow::eye : LightsFollow::model;
    look.options.lights_follow = std::nullopt;
    if (chosen != look.lights_follow())
        look.options.lights_follow = chosen;
    return true;
}

bool edit_headlight(std::optional<Headlight> &headlight) {
    bool on = headlight.has_value();
    if (ImGui::Checkbox("Headlight: follows the camera", &on)) {
        headlight = on ? std::optional(Headlight{}) : std::nullopt;
        return true;
    }
    if (!on)
        return false;
    double right = glm::radians(headlight->right), up = glm::radians(headlight->up);
    const bool turned = edit_angle("From the right", right, 90), raised = edit_angle("From above", up, 90);
    if (turned)
        headlight->right = std::round(glm::degrees(right));
    if (raised)
        headlight->up = std::round(glm::degrees(up));
    return turned || raised;
}

// Offers all of `count` things by name; there is always one.
template <class Name> void choose_one(const char *label, std::size_t count, std::size_t &chosen, const Name &name) {
    chosen = std::min(chosen, count - 1);
    if (count == 1) {
        ImGui::TextUnformatted(name(chosen).c_str());
        return;
    }
    if (!ImGui::BeginCombo(label, name(chosen).c_str()))
        return;
    for (std::size_t i = 0; i < count; ++i)
        if (ImGui::Selectable(name(i).c_str(), i == chosen))
            chosen = i;
    ImGui::EndCombo();
}

bool choose_preset(Material &material, const Material &of_file) {
    bool changed = false;
    if (!ImGui::BeginCombo("Preset", "choose ..."))
        return false;
    const auto offer = [&](std::string_view name, Material preset) {
        preset.tint = of_file.tint; // edits keep it
        if (ImGui::Selectable(std::string(name).c_str(), material == preset)) {
            material = preset;
            changed = true;
        }
    };
    offer("as in the file", of_file);
    for (const MaterialPreset &preset : kMaterialPresets)
        offer(preset.name, preset.material);
    ImGui::EndCombo();
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

void Panel::show_model(PanelModel model, const Look &first) {
    model_ = std::move(model);
    first_ = first;
    light_ = material_ = 0;
}

int Panel::docked_width(glm::ivec2 size, float scale) {
    const float width = (kWidth + 2 * kMargin) * scale;
    return width <= kMaxShare * static_cast<float>(size.x) ? static_cast<int>(width) : 0;
}

std::optional<PanelAction> Panel::take_action() { return std::exchange(action_, std::nullopt); }

void Panel::build_model() const {
    const Grid &grid = model_.file->grid;
    const bool has_unit = grid.unit != Unit::unknown;
    const std::string unit = has_unit ? " " + std::string(to_string(grid.unit)) : "";
    ImGui::TextWrapped("%s", (model_.notes.name.empty() ? model_.title : model_.notes.name).c_str());
    ImGui::TextWrapped("%s points, %d levels", grouped(model_.points).c_str(), grid.depth);
    ImGui::TextWrapped("%.4g%s across, voxels of %.3g%s", 2 * model_.bounds.radius, unit.c_str(), grid.voxel_size,
                       has_unit ? unit.c_str() : "; the file names no unit");
    if (!model_.notes.credit.empty())
        ImGui::TextWrapped("Credit: %s", model_.notes.credit.c_str());
    if (!model_.notes.licence.empty())
        ImGui::TextWrapped("Licence: %s", model_.notes.licence.c_str());
}

bool Panel::build_lights(Look &look, const std::string &shadows) {
    bool changed = edit_headlight(look.options.headlight);
    if (look.options.headlight) {
        ImGui::TextWrapped("It lights alone, without shadows.");
        return changed;
    }
    changed |= edit_lights_follow(look);
    std::vector<Light> &lights = look.appearance.lights;
    choose_one("Light", lights.size(), light_, [&](std::size_t i) { return light_name(lights[i], i); });
    Light &light = lights[light_];
    ImGui::PushID(static_cast<int>(light_));
    changed |= edit_intensity(light.intensity);
    changed |= edit_place(*model_.file, light_frame(model_.file->grid, model_.bounds, look.appearance.up), light);
    if (light.kind == LightKind::spot)
        changed |= ImGui::SliderFloat("Exponent", &light.exponent, 0, 128, "%.1f", ImGuiSliderFlags_AlwaysClamp);
    ImGui::PopID();
    if (!shadows.empty())
        ImGui::TextWrapped("%s", shadows.c_str());
    ImGui::TextWrapped("Hold L and drag: it comes from where the pointer is.");
    return changed;
}

bool Panel::build_materials(Appearance &appearance) {
    std::vector<Material> &materials = appearance.materials;
    choose_one("Material", materials.size(), material_,
               [&](std::size_t i) { return material_name(materials[i], i, model_.notes); });
    Material &material = materials[material_];
    bool changed = false;
    const auto edit = [&](const char *label, float &value) {
        changed |= ImGui::SliderFloat(label, &value, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp);
    };
    ImGui::PushID(static_cast<int>(100 + material_));
    changed |= choose_preset(material, model_.file->materials[material_]);
    changed |= edit_colour("Colour", material.colour);
    edit("Ambient", material.ka);
    edit("Diffuse", material.kd);
    edit("Specular", material.ks);
    changed |= ImGui::SliderFloat("Power", &material.power, 1, 1024, "%.0f",
                                  ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
    if (model_.has_panorama)
        edit("Reflection", material.environment);
    ImGui::PopID();
    if (model_.file->attributes.colour != ColourFormat::none)
        ImGui::TextWrapped("Points with colours of their own keep them.");
    return changed;
}

bool Panel::build(Look &look, glm::ivec2 size, float scale, const std::string &shadows) {
    const ImGuiCond place = size == size_ ? ImGuiCond_Once : ImGuiCond_Always;
    size_ = size;
    const auto width = static_cast<float>(size.x), height = static_cast<float>(size.y), margin = kMargin * scale;
    ImGuiWindowFlags flags = ImGuiWindowFlags_NoSavedSettings;
    if (const auto docked = static_cast<float>(docked_width(size, scale)); docked > 0) {
        ImGui::SetNextWindowPos({width - docked, 0});
        ImGui::SetNextWindowSize({docked, height});
        flags |= ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse;
    } else {
        const float own_width = std::clamp(width - 2 * margin, 1.0F, kWidth * scale);
        ImGui::SetNextWindowPos({width - own_width - margin, margin}, place);
        ImGui::SetNextWindowSizeConstraints({own_width, 0}, {own_width, std::max(1.0F, height - 2 * margin)});
        flags |= ImGuiWindowFlags_AlwaysAutoResize;
    }
    if (std::exchange(takes_focus_, false))
        ImGui::SetNextWindowFocus();
    bool changed = false;
    if (ImGui::Begin("Model and light (Tab)", nullptr, flags)) {
        ImGui::PushItemWidth(kItemWidth * scale);
        // Build every part, even if an earlier one reports a change.
        changed = build_switches(*model_.file, model_.has_panorama, look.options.render);
        changed = build_quality(look) || changed;
        changed = build_colours(*model_.file, look.options) || changed;
        if (model_.colours != nullptr)
            changed = build_classes(*model_.file, *model_.colours, look.options.classes) || changed;
        if (ImGui::CollapsingHeader("Lights"))
            changed = build_lights(look, shadows) || changed;
        if (ImGui::CollapsingHeader("Materials"))
            changed = build_materials(look.appearance) || changed;
        changed = build_palettes(*model_.file, look.appearance) || changed;
        if (ImGui::Button("Reset")) {
            look = *first_;
            changed = true;
        }
        ImGui::SameLine();
        if (ImGui::Button("Copy as options"))
            action_ = PanelAction::copy_options;
        ImGui::SameLine();
        if (ImGui::Button("Save ..."))
            action_ = PanelAction::save;
        if (ImGui::CollapsingHeader("Model", ImGuiTreeNodeFlags_DefaultOpen))
            build_model();
        int theme = static_cast<int>(theme_);
        if (ImGui::Combo("Theme", &theme, "as the desktop\0dark\0light\0"))
            theme_ = static_cast<Theme>(theme);
        ImGui::PopItemWidth();
    }
    ImGui::End();
    return changed;
}

} // namespace pbm
