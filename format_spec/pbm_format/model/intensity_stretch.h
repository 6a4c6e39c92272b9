// How the strength of a laser's echoes becomes a grey. The scale of the values differs from scanner to scanner, a few
// echoes of mirrors are far above all others, and most are weak.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace pbm {

// Values between black and white: all but so many hundredths at each end.
inline constexpr std::size_t kOmittedIntensities = 2;

// The gamma for which the grey ((value - least) / (most - least))^gamma of the median is the middle one.
inline double intensity_gamma(double least, double median, double most) {
    constexpr double kSteepest = 4;
    if (!(median > least && median < most))
        return median > least ? kSteepest : 1 / kSteepest;
    return std::clamp(std::log(0.5) / std::log((median - least) / (most - least)), 1 / kSteepest, kSteepest);
}

} // namespace pbm
