#include "viewer/finish/scale_bar.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace pbm {
namespace {

std::string bar_text(double length, Unit unit) {
    std::string name = unit_text(unit);
    constexpr double kRounding = 1 + 1e-9;
    if (unit == Unit::metre && length * kRounding < 1) {
        const bool is_small = length * kRounding < 0.01;
        length *= is_small ? 1000 : 100;
        name = is_small ? "mm" : "cm";
    }
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", length);
    return std::string(text.data()) + " " + name;
}

} // namespace

ScaleBar scale_bar(double pixel_size, double max_pixels, Unit unit) {
    const double longest = pixel_size * max_pixels;
    const double power = std::pow(10.0, std::floor(std::log10(longest)));
    const double digit = longest >= 5 * power ? 5 : longest >= 2 * power ? 2 : 1;
    const double length = digit * power;
    return {length, length / pixel_size, bar_text(length, unit)};
}

std::string unit_text(Unit unit) { return unit == Unit::unknown ? "units" : std::string(to_string(unit)); }

} // namespace pbm
