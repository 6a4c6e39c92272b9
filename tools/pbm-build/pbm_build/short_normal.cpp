#include "pbm_build/short_normal.h"

namespace pbm::build {

// The same operations as in to_short_normal, so that the compiler may do them on several rows.
void NormalColumns::round() {
    const auto &[x, y, z] = from;
    Column scale;
    for (std::size_t i = 0; i < kRows; ++i) {
        const double length = std::sqrt((x[i] * x[i] + y[i] * y[i]) + z[i] * z[i]);
        const double divided = kNormalScale / length;
        const double to_round = length > 0 ? divided : 0;
        scale[i] = is_rounded[i] > 0 ? 1 : to_round;
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; i < kRows; ++i) {
            const double v = from[axis][i];
            rounded[axis][i] = static_cast<std::int32_t>(v * scale[i] + std::copysign(0.5, v));
        }
}

} // namespace pbm::build
