#include "pbm_scan/conventions/geographic.h"

#include "pbm_scan/conventions/crs.h"
#include "pbm_scan/text/printable.h"

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace pbm::build {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct PositionBox {
    glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-low};
};

PositionBox box_of(const Surface &surface) {
    PositionBox box;
    for (const glm::dvec3 &p : surface.positions) {
        box.low = glm::min(box.low, p);
        box.high = glm::max(box.high, p);
    }
    return box;
}

// From the centre of the earth, x through the meridian of Greenwich.
glm::dvec3 geocentric(double longitude, double latitude, double height) {
    constexpr double kRadius = 6378137, kFlattening = 1 / 298.257223563, kSquared = kFlattening * (2 - kFlattening);
    const double s = std::sin(latitude), c = std::cos(latitude);
    const double normal = kRadius / std::sqrt(1 - kSquared * s * s);
    return {(normal + height) * c * std::cos(longitude), (normal + height) * c * std::sin(longitude),
            (normal * (1 - kSquared) + height) * s};
}

} // namespace

void degrees_to_metres(Surface &surface, double height_metres) {
    const PositionBox box = box_of(surface);
    if (surface.positions.empty() ||
        !(box.low.x >= -360 && box.high.x <= 360 && box.low.y >= -90 && box.high.y <= 90)) {
        surface.report.push_back(
            {"degrees", Fate::kept, "coordinates beyond 360 and 90 are no degrees: left as they are"});
        return;
    }
    const glm::dvec3 centre = 0.5 * (box.low + box.high);
    const double longitude = centre.x * kDegree, latitude = centre.y * kDegree;
    const double sl = std::sin(longitude), cl = std::cos(longitude), sb = std::sin(latitude), cb = std::cos(latitude);
    const glm::dvec3 east(-sl, cl, 0), north(-sb * cl, -sb * sl, cb), up(cb * cl, cb * sl, sb);
    const glm::dmat3 to_local = glm::transpose(glm::dmat3(east, north, up));
    const glm::dvec3 origin = geocentric(longitude, latitude, 0);
    const auto convert = [&](glm::dvec3 &p) {
        p = to_local * (geocentric(p.x * kDegree, p.y * kDegree, p.z * height_metres) - origin);
    };
    std::for_each(surface.positions.begin(), surface.positions.end(), convert);
    std::for_each(surface.stations.begin(), surface.stations.end(), convert);
    const std::string place = formatted("longitude %.9g, latitude %.9g, height 0", centre.x, centre.y);
    surface.report.push_back({"degrees", Fate::converted,
                              "to metres east, north and up of " + place +
                                  " (WGS 84), exact to 1e-8 m; the ground falls away by 0.08 m at 1 km"});
    const std::string name = short_crs(surface.crs);
    surface.crs = "metres east, north and up of " + place + " on WGS 84" + (name.empty() ? "" : "; from " + name);
    surface.convention = Convention{.up = UpAxis::z,
                                    .up_reason = "upwards of the place at the centre",
                                    .unit = Unit::metre,
                                    .unit_reason = "of degrees"};
}

bool look_like_degrees(const Surface &surface) {
    constexpr double kMaxWidth = 0.2, kMinRatio = 50;
    if (surface.positions.empty())
        return false;
    const auto &positions = surface.positions;
    const glm::dvec3 &first = positions.front();
    const auto is_near = [&](const glm::dvec3 &p) {
        return std::abs(p.x - first.x) < kMaxWidth && std::abs(p.y - first.y) < kMaxWidth;
    };
    // Most scans fail here, without a look at all positions.
    if (std::abs(first.x) < 1 || std::abs(first.x) > 180 || std::abs(first.y) < 1 || std::abs(first.y) > 90 ||
        !is_near(positions[positions.size() / 2]) || !is_near(positions[positions.size() / 3]) ||
        !is_near(positions.back()))
        return false;
    const PositionBox box = box_of(surface);
    const auto is_apart = [&](int axis) { return box.low[axis] > 1 || box.high[axis] < -1; };
    const double width = std::max(box.high.x - box.low.x, box.high.y - box.low.y);
    return is_apart(0) && is_apart(1) && width > 0 && width < kMaxWidth && box.low.x >= -180 && box.high.x <= 180 &&
           box.low.y >= -90 && box.high.y <= 90 && box.high.z - box.low.z > kMinRatio * width;
}

} // namespace pbm::build
