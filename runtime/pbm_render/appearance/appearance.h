// What the viewer may edit of a model: no point and no texel depends on it.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <optional>
#include <vector>

namespace pbm {

// The stream whose values are indices of Appearance::palette, if the points have one.
std::optional<StreamInfo> palette_stream(const AttributeSet &set);

struct Appearance {
    // Copies the file's appearance; uses default_lights if the file has no lights.
    explicit Appearance(const ModelParameters &parameters);

    std::vector<Material> materials; // as many as the file has
    std::vector<Light> lights;       // at most kMaxLights; the first ones own the file's shadow streams
    std::array<Rgb8, 256> palette{}; // for the values of palette_stream
    std::array<Rgb8, 256> ground_palette{};
    bool operator==(const Appearance &) const = default;
};

} // namespace pbm
