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
    bool has_one_colour = false; // all points do
    UpAxis up = UpAxis::y;       // lights that follow the eye are stored as placed for the eye of front_axes(up)
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

// Returns the appearance for the eye with these axes, all lights fixed to the model. Lights that follow the eye are
// rotated about the grid's centre, as the eye is rotated from front_axes. They cast no shadows, since baked shadows do
// not apply to them.
Appearance turn_lights(const EyeAxes &eye, const Grid &grid, Appearance appearance);

// How points take light.
//   automatic  points that show their own colours, more than one, take a soft light, under which a surface that faces
//   the
//              eye keeps its colour: photographs have their light in them. It takes the place of default_lights, unless
//              lights or materials were edited. Everything else is lit
//   lit        by the lights and materials of the appearance
//   unlit      every point has its own colour, or that of its material
enum class Shading : std::uint8_t { automatic, lit, unlit };

// A renderer leaves out what the file does not hold, whatever these options say.
struct RenderOptions {
    Rgba8 background{51, 51, 51, 255};       // sRGB; drawn where there is no panorama
    std::optional<Rgba8> background_below{}; // at the lower edge, with a gradient from `background` at the upper one
    bool texture = true;                     // draw points and ground plane in the colours of their solid texture
    bool point_colours = true; // draw points without texture in their own colour; false: in that of their material
    bool shadows = true;       // false: every light reaches every point
    bool panorama = true;      // the panorama is drawn behind everything
    bool ground = true;        // the ground plane is drawn
    bool reflections = true;   // materials with an environment factor reflect the panorama
    Shading shading = Shading::automatic;
    bool operator==(const RenderOptions &) const = default;
};

// The background, from `down` = 0 at the upper edge of the picture to 1 at the lower one.
Rgba8 background_at(const RenderOptions &options, double down);
// Fills a picture with it, and its depths with +infinity.
void clear(const RenderOptions &options, Framebuffer &picture);

// Where the colours of points come from: their material, their colours (BVG.md 6.3) or their solid texture.
enum class ColourSource : std::uint8_t { material, rgb565, rgb888, texture };
ColourSource colour_source(const AttributeSet &set, const RenderOptions &options);

// The appearance with which every renderer draws a frame of a model with these `parameters`: its lights are fixed to
// the model, and its materials take light as `options.shading` says.
Appearance appearance_in_frame(const ModelParameters &parameters, const RenderOptions &options, const EyeAxes &eye,
                               Appearance appearance);

struct RenderStatistics {
    int level = 0;                  // finest detail level drawn
    std::uint64_t points = 0;       // points of all runs
    std::uint64_t drawn_points = 0; // those that face the eye and lie in front of it
};

} // namespace pbm
