// What the viewer may edit of a model: no point and no texel depends on it.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
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

struct Appearance {
    // Copies the file's appearance; uses default_lights if the file has no lights.
    explicit Appearance(const ModelParameters &parameters);

    std::vector<Material> materials;                // as many as the file has
    std::vector<Light> lights;                      // at most kMaxLights; the first ones own the file's shadow streams
    std::array<ShadowSource, kMaxLights> shadows{}; // of these
    std::array<Rgb8, 256> palette{};                // for the values of palette_stream
    std::array<Rgb8, 256> ground_palette{};
    bool operator==(const Appearance &) const = default;
};

} // namespace pbm
