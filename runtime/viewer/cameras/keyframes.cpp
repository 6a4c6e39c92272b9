#include "viewer/cameras/keyframes.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

// Along the shorter arc.
glm::dvec4 slerp(const glm::dvec4 &from, glm::dvec4 to, double part) {
    double cosine = glm::dot(from, to);
    if (cosine < 0) {
        to = -to;
        cosine = -cosine;
    }
    const double angle = std::acos(std::min(cosine, 1.0));
    constexpr double kStraight = 1e-6; // radians: below, the arc is its chord
    if (angle < kStraight)
        return glm::mix(from, to, part);
    return (std::sin((1 - part) * angle) * from + std::sin(part * angle) * to) / std::sin(angle);
}

} // namespace

glm::dvec4 Keyframes::at(double time) const {
    constexpr double kRounding = 1e-4; // seconds: keys are floats, and a frame that is cut to must not come too late
    if (interpolation == Interpolation::step)
        time += kRounding;
    const std::size_t last = times.size() - 1;
    const std::size_t in_key = interpolation == Interpolation::cubic ? 3 : 1, middle = in_key / 2;
    const auto value = [&](std::size_t key) { return values[key * in_key + middle]; };
    if (time <= times.front() || last == 0)
        return value(0);
    if (time >= times.back())
        return value(last);
    const auto after = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
    const std::size_t before = after - 1;
    const double span = times[after] - times[before], part = (time - times[before]) / span;
    if (interpolation == Interpolation::step)
        return value(before);
    if (interpolation == Interpolation::linear)
        return is_rotation ? slerp(value(before), value(after), part) : glm::mix(value(before), value(after), part);
    const double square = part * part, cube = square * part;
    return (2 * cube - 3 * square + 1) * value(before) + span * (cube - 2 * square + part) * values[3 * before + 2] +
           (3 * square - 2 * cube) * value(after) + span * (cube - square) * values[3 * after];
}

} // namespace pbm
