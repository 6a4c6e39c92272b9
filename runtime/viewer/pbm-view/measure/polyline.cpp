#include "viewer/pbm-view/measure/polyline.h"

#include "viewer/finish/scale_bar.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace pbm {
namespace {

// Decimals that show two digits of the uncertainty.
int decimals_of(double uncertainty) {
    constexpr int kMaxDecimals = 17;
    if (!(uncertainty > 0) || !std::isfinite(uncertainty))
        return kMaxDecimals;
    return std::clamp(1 - static_cast<int>(std::floor(std::log10(uncertainty))), 0, kMaxDecimals);
}

std::string fixed(double value, int decimals) {
    std::array<char, 512> text{}; // the largest double has 309 digits
    std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
    return text.data();
}

} // namespace

double point_uncertainty(double finest, double coarsest, double max_error, double pixel_size) {
    const double voxel = std::clamp(max_error * pixel_size, finest, std::max(finest, coarsest));
    return voxel * std::sqrt(3.0) / 2;
}

void Polyline::remove_last() {
    if (!points_.empty())
        points_.pop_back();
}

Length Polyline::segment(std::size_t i) const {
    const MeasuredPoint &from = points_[i], &to = points_[i + 1];
    return {glm::length(to.place - from.place), std::hypot(from.uncertainty, to.uncertainty)};
}

Length Polyline::total() const {
    Length sum{0, 0};
    for (std::size_t i = 0; i < points_.size(); ++i) {
        const bool is_end = i == 0 || i + 1 == points_.size();
        sum.uncertainty = std::hypot(sum.uncertainty, (is_end ? 1 : 2) * points_[i].uncertainty);
        if (i > 0)
            sum.value += segment(i - 1).value;
    }
    return sum;
}

std::string length_text(const Length &length, Unit unit) {
    const int decimals = decimals_of(length.uncertainty);
    return fixed(length.value, decimals) + " ± " + fixed(length.uncertainty, decimals) + " " + unit_text(unit);
}

std::string point_text(const MeasuredPoint &point, Unit unit) {
    const int decimals = decimals_of(point.uncertainty);
    return fixed(point.place.x, decimals) + ", " + fixed(point.place.y, decimals) + ", " +
           fixed(point.place.z, decimals) + " " + unit_text(unit);
}

std::string polyline_text(const Polyline &line, Unit unit) {
    const std::span<const MeasuredPoint> points = line.points();
    std::string text;
    for (std::size_t i = 0; i < points.size(); ++i)
        text += "point " + std::to_string(i + 1) + ": " + point_text(points[i], unit) + '\n';
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
        text += "distance " + std::to_string(i + 1) + " to " + std::to_string(i + 2) + ": " +
                length_text(line.segment(i), unit) + '\n';
    if (points.size() > 2)
        text += "along all: " + length_text(line.total(), unit) + '\n';
    return text;
}

} // namespace pbm
