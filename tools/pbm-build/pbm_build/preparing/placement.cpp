#include "pbm_build/preparing/placement.h"

#include "pbm_build/lattice/lattice.h"

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

// Tests the low fraction bits, because g++ 12 optimises away a conversion to float and back in a vectorised loop.
// Ignores denormal floats.
bool is_single_precision(double value) {
    constexpr int kMoreBits = std::numeric_limits<double>::digits - std::numeric_limits<float>::digits;
    return (std::bit_cast<std::uint64_t>(value) & ((std::uint64_t{1} << kMoreBits) - 1)) == 0;
}

// The largest absolute coordinate along an axis, or 0 if one of them is not in single precision.
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
    const glm::dvec3 origin = vector_of(placement.origin.value_or(std::array<double, 3>{}));
    for (glm::dvec3 &p : surface.positions)
        p = scale * p + origin;
    for (glm::dvec3 &station : surface.stations)
        station = scale * station + origin;
    for (SceneView &view : surface.views) {
        view.position = scale * view.position + origin;
        view.focal_point = scale * view.focal_point + origin;
    }
    for (float &radius : surface.radii)
        if (radius > 0)
            radius = static_cast<float>(std::clamp(static_cast<double>(radius) * scale,
                                                   static_cast<double>(std::numeric_limits<float>::denorm_min()),
                                                   static_cast<double>(std::numeric_limits<float>::max())));
}

} // namespace pbm::build
