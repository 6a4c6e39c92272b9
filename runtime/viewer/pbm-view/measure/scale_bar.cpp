#include "viewer/pbm-view/measure/scale_bar.h"

#include "viewer/pbm-view/measure/polyline.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace pbm {

ScaleBar scale_bar(double pixel_size, double max_pixels, Unit unit) {
    const double longest = pixel_size * max_pixels;
    const double power = std::pow(10.0, std::floor(std::log10(longest)));
    const double digit = longest >= 5 * power ? 5 : longest >= 2 * power ? 2 : 1;
    const double length = digit * power;
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", length);
    return {length, length / pixel_size, std::string(text.data()) + " " + unit_text(unit)};
}

} // namespace pbm
