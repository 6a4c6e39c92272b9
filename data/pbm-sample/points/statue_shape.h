// The statue's surface: a woman in a long robe on a square plinth, 1.8 m high, front to +Z, centred on the origin.
//
// Its skeleton is a vertical line. The nearest point of the line and the direction from there name a place on a capsule
// of radius kCapsule around the line; the surface lies at the distance radius(place) in that direction. So it is
// closed, each place has one point, and a point in space lies inside if its distance from the line is below the radius.
#pragma once

#include "pbm-sample/noise/jet.h"

#include <cstdint>

namespace pbm::sample {

inline constexpr float kLineLow = -0.80f, kLineHigh = 0.74f; // metres, ends of the line on the y axis
inline constexpr float kCapsule = 0.2f;

struct Lanes3 {
    Float4 x, y, z;
};

// A place on the capsule. `direction`: unit, from the line.
struct CapsulePlace {
    Lanes3 direction;
    Float4 line_y; // of the nearest point of the line
    Lanes3 position() const {
        return {direction.x * kCapsule, line_y + direction.y * kCapsule, direction.z * kCapsule};
    }
    Lanes3 at(Float4 radius) const {
        return {direction.x * radius, line_y + direction.y * radius, direction.z * radius};
    }
};

// By parameters: u from the lowest point (0) to the highest one (1), v once around from the back, both in [0, 1].
CapsulePlace capsule_place(Float4 u, Float4 v);
// By a point in space that does not lie on the line.
CapsulePlace capsule_place(const Lanes3 &point);

struct StatueRadius {
    Jet3 radius;   // metres; slopes by the place's x, y, z
    Float4 cavity; // 0 on the open surface to 1 in the deepest folds and pits
};
StatueRadius statue_radius(const CapsulePlace &place, std::uint32_t seed);

// Outward unit normals of the surface.
Lanes3 statue_normal(const CapsulePlace &place, const Jet3 &radius);

} // namespace pbm::sample
