// What of a model may change while it is looked at: no point, no texel depends on it.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <vector>

namespace pbm {

struct Appearance {
    // That of the file, with default_lights where it has none.
    explicit Appearance(const ModelParameters &parameters);

    std::vector<Material> materials; // as many as the file has
    std::vector<Light> lights;       // at most kMaxLights; those of the file's shadow streams keep their places
    std::array<Rgb8, 256> palette{}; // of the solid texture's values
    std::array<Rgb8, 256> ground_palette{};
    bool operator==(const Appearance &) const = default;
};

} // namespace pbm
