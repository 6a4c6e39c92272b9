// A line through picked points of the surface: its lengths, their uncertainties, and these as text.
#pragma once

#include "pbm_format/model/model.h"

#include <glm/vec3.hpp>

#include <span>
#include <string>
#include <vector>

namespace pbm {

struct MeasuredPoint {
    glm::dvec3 place;   // model space
    double uncertainty; // model units: how far the true surface may lie from `place`
};

// Half the diagonal of the voxel that shows a point: the surface passes through the voxel. `finest` and `coarsest` are
// the edges of the smallest and largest voxels of the picture; where `pixel_size` is known, no voxel is larger than
// `max_error` pixels unless it is of the finest level.
double point_uncertainty(double finest, double coarsest, double max_error, double pixel_size);

struct Length {
    double value, uncertainty; // model units
};

class Polyline {
  public:
    void add(const MeasuredPoint &point) { points_.push_back(point); }
    void remove_last();
    void clear() { points_.clear(); }

    std::span<const MeasuredPoint> points() const { return points_; }
    // Between points i and i + 1. The errors of the two points are independent: their squares add.
    Length segment(std::size_t i) const;
    // Of all segments; 0 for a single point. A point between two segments may lengthen or shorten both, so that its
    // error counts twice.
    Length total() const;

  private:
    std::vector<MeasuredPoint> points_;
};

// "12.35 ± 0.12 mm": the uncertainty with two digits, the value as far as the uncertainty goes.
std::string length_text(const Length &length, Unit unit);
// "500123.45, 8500001.23, 12.30 m", as far as the uncertainty goes.
std::string point_text(const MeasuredPoint &point, Unit unit);
// A line each for the points, the segments and the total.
std::string polyline_text(const Polyline &line, Unit unit);

} // namespace pbm
