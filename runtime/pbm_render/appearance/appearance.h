// The appearance of a model: materials, lights and palettes, which a program may edit without changing points or
// texels. Also the options that all renderers share; options of one renderer are in its own header.
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace pbm {

class TexelLevels;

// The stream whose values are indices of Appearance::palette, if the points have one.
std::optional<StreamInfo> palette_stream(const AttributeSet &set);

// Lit fractions of one light that a program has baked anew, in place of those of the file.
struct LitFractions {
    std::vector<Bytes> levels;                 // [depth + 1][points of the level]: 0, in shadow, .. 255, lit
    std::shared_ptr<const TexelLevels> ground; // of the ground plane, one raster; null: no shadow falls on it
};

// Where the shadows of a light with a shadow stream come from.
struct ShadowSource {
    bool of_file = true;                       // the light's stream and raster
    std::shared_ptr<const LitFractions> fresh; // unless `of_file`; null: the light casts no shadow
    bool operator==(const ShadowSource &) const = default;
};

// What the lights are fixed to while the camera moves.
enum class LightsFollow : std::uint8_t { eye, model };

// Lights from beside the eye, for files without lights: a key light from the upper left and a weaker fill light from
// the right, as seen by the eye of front_axes.
std::vector<Light> default_lights(UpAxis up);

struct Appearance {
    // Copies the file's appearance. The lights of a file follow the model. A file without lights gets default_lights,
    // which follow the eye.
    explicit Appearance(const ModelParameters &parameters);

    std::vector<Material> materials; // as many as the file has
    std::vector<Light> lights;       // at most kMaxLights; the first ones own the file's shadow streams
    LightsFollow lights_follow = LightsFollow::model;
    UpAxis up = UpAxis::y; // lights that follow the eye are stored as placed for the eye of front_axes(up)
    std::array<ShadowSource, kMaxLights> shadows{}; // of these
    std::array<Rgb8, 256> palette{};                // for the values of palette_stream
    std::array<Rgb8, 256> ground_palette{};
    bool operator==(const Appearance &) const = default;
};

// Replaces the lights by one that follows the eye: its light comes from `right` radians to the right of the eye and
// `up` above it.
void set_headlight(Appearance &appearance, double right, double up);

// Returns the lights to store in `file`: those of the appearance, or none if they still are the default_lights of a
// file without lights.
std::vector<Light> lights_to_keep(const Appearance &appearance, const ModelParameters &file);

// Returns the appearance with which every renderer draws a frame for the eye with these axes: all lights are fixed to
// the model. Lights that follow the eye are rotated about the grid's centre, as the eye is rotated from front_axes.
// They cast no shadows, since baked shadows do not apply to them.
Appearance turn_lights(const EyeAxes &eye, const Grid &grid, Appearance appearance);

// A renderer leaves out what the file does not hold, whatever these options say.
struct RenderOptions {
    Rgba8 background{51, 51, 51, 255}; // sRGB; drawn where there is no panorama
    bool texture = true;               // draw points and ground plane in the colours of their solid texture
    bool point_colours = true; // draw points without texture in their own colour; false: in that of their material
    bool shadows = true;       // false: every light reaches every point
    bool panorama = true;      // the panorama is drawn behind everything
    bool ground = true;        // the ground plane is drawn
    bool reflections = true;   // materials with an environment factor reflect the panorama
    bool operator==(const RenderOptions &) const = default;
};

struct RenderStatistics {
    int level = 0;                  // finest detail level drawn
    std::uint64_t points = 0;       // points of all runs
    std::uint64_t drawn_points = 0; // those that face the eye and lie in front of it
};

} // namespace pbm
