// Values that change with time: one channel of a glTF animation.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (appendix C)
#pragma once

#include <glm/vec4.hpp>

#include <cstdint>
#include <vector>

namespace pbm {

enum class Interpolation : std::uint8_t { step, linear, cubic };

struct Keyframes {
    Interpolation interpolation = Interpolation::linear;
    bool is_rotation = false;       // the values are quaternions x, y, z, w; between them lie unit quaternions
    std::vector<double> times;      // seconds, ascending, at least one
    std::vector<glm::dvec4> values; // one a key; cubic: three, the tangent before the key, its value, the one after it

    // The first value before the first key, the last one after the last key.
    glm::dvec4 at(double time) const;
};

} // namespace pbm
