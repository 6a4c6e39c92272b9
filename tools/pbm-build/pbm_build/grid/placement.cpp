#include "pbm_build/grid/placement.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace pbm::build {
namespace {

// Distance between numbers of single precision of this size.
double float_spacing(double size) {
    int exponent = 0;
    std::frexp(size, &exponent);
    return std::ldexp(1.0, std::max(exponent, std::numeric_limits<float>::min_exponent) -
                               std::numeric_limits<float>::digits);
}

// By its bits: of a conversion to float and back in a loop over vectors g++ 12 leaves nothing. Numbers too small for
// float's full precision do not matter here.
bool is_single_precision(double value) {
    constexpr int kMoreBits = std::numeric_limits<double>::digits - std::numeric_limits<float>::digits;
    return (std::bit_cast<std::uint64_t>(value) & ((std::uint64_t{1} << kMoreBits) - 1)) == 0;
}

// The largest coordinate, in size, along an axis, or 0 where one needs more than single precision.
double largest_single(const Surface &surface, int axis) {
    double largest = 0;
    for (const glm::dvec3 &p : surface.positions) {
        const double size = std::fabs(p[axis]);
        if (!(size <= static_cast<double>(std::numeric_limits<float>::max())) || !is_single_precision(size))
            return 0;
        largest = std::max(largest, size);
    }
    return largest;
}

} // namespace

void place(Surface &surface, const Placement &placement) {
    const double scale = placement.scale.value_or(1);
    for (int axis = 0; axis < 3; ++axis)
        surface.float_near = std::max(surface.float_near, largest_single(surface, axis));
    surface.float_step = surface.float_near > 0 ? float_spacing(surface.float_near) * scale : 0;
    if (!placement.scale && !placement.origin)
        return;
    const std::array<double, 3> shift = placement.origin.value_or(std::array<double, 3>{});
    const glm::dvec3 origin(shift[0], shift[1], shift[2]);
    for (glm::dvec3 &p : surface.positions)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = scale * p[axis] + origin[axis];
    for (float &radius : surface.radii)
        if (radius > 0)
            radius = static_cast<float>(std::clamp(static_cast<double>(radius) * scale,
                                                   static_cast<double>(std::numeric_limits<float>::denorm_min()),
                                                   static_cast<double>(std::numeric_limits<float>::max())));
}

} // namespace pbm::build
