// A plane and a box that cut a model open: a picture shows only the points on the inner side of both.
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace pbm {

// Keeps the side that the normal leads to.
struct ClipPlane {
    glm::dvec3 point{0};
    glm::dvec3 normal{0, 0, 1}; // not zero, of any length
    bool operator==(const ClipPlane &) const = default;
};

// Along the axes; keeps what lies inside.
struct ClipBox {
    glm::dvec3 least{0}, most{0};
    bool operator==(const ClipBox &) const = default;
};

struct ClipRegion {
    std::optional<ClipPlane> plane;
    std::optional<ClipBox> box;

    bool empty() const { return !plane && !box; }
    bool operator==(const ClipRegion &) const = default;
};

// The points p with dot(normal, p) + offset >= 0; the normal has length 1.
struct HalfSpace {
    glm::dvec3 normal;
    double offset;
};

// The half-spaces whose intersection is a region; none for all of space.
class HalfSpaces {
  public:
    static constexpr std::size_t kMax = 7; // six of a box, one of a plane

    explicit HalfSpaces(const ClipRegion &region);
    std::span<const HalfSpace> all() const { return std::span(half_spaces_).first(count_); }
    bool empty() const { return count_ == 0; }

    // How a box along the axes lies to the region. `cut`: some of it may be inside.
    enum class Side { outside, cut, inside };
    Side side_of(const glm::dvec3 &centre, const glm::dvec3 &half_edges) const;

  private:
    std::array<HalfSpace, kMax> half_spaces_;
    std::size_t count_ = 0;
};

} // namespace pbm
