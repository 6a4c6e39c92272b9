// What of a model may change while it is looked at: no point, no texel depends on it.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <optional>
#include <vector>

namespace pbm {

// The stream of points whose values are indices of Appearance::palette; none if they have no such stream.
std::optional<StreamInfo> palette_stream(const AttributeSet &set);

struct Appearance {
    // That of the file, with default_lights where it has none.
    explicit Appearance(const ModelParameters &parameters);

    std::vector<Material> materials; // as many as the file has
    std::vector<Light> lights;       // at most kMaxLights; those of the file's shadow streams keep their places
    std::array<Rgb8, 256> palette{}; // of palette_stream's values
    std::array<Rgb8, 256> ground_palette{};
    bool operator==(const Appearance &) const = default;
};

} // namespace pbm
