// The points of a level that lies in memory as a whole, as they are drawn: round points (round_points.h), and both
// sides of points with sides (BVG.md 19.4), each a point of its own.
#pragma once

#include "pbm_render/bricks/round_points.h"

#include <cstddef>
#include <optional>

namespace pbm {

class DrawnLevel {
  public:
    // `model` must outlive the result.
    DrawnLevel(const Model &model, int level);
    DrawnLevel(const DrawnLevel &) = delete;
    DrawnLevel &operator=(const DrawnLevel &) = delete;

    // The level's points, of which those with sides have their first one, and then the second sides.
    const PointView &values() const { return values_; }
    // The same with the normals and radii that round points are drawn with, and kSideBits of sides.
    const PointView &drawn() const { return drawn_; }

    bool has_sides() const { return sides_.size() > 0; }
    // The index of the second side of a point.
    std::optional<std::size_t> second(std::size_t point) const;
    // The point of the level that `index` is a side of.
    std::size_t origin(std::size_t index) const {
        return index < count_ ? index : std::size_t{sides_.points[index - count_]};
    }

  private:
    const Sides &sides_;
    std::size_t count_; // points of the level
    PointAttributes both_;
    PointView values_, drawn_;
    MarkedPoints marked_;
};

} // namespace pbm
