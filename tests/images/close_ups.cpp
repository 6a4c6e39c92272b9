#include "close_ups.h"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>

namespace pbm {
namespace {

constexpr std::array<double, 4> kPixelsPerVoxel{4, 5, 6, 8};
constexpr double kClearance = 4; // voxels of free space in front of the place

struct Place {
    glm::dvec3 at, normal;
};

// The surface at a pixel with the mean normal around it, since one triangle of a rough surface is not representative.
std::optional<Place> place_at(const RayCaster &rays, const PixelRays &pixels, double x, double y) {
    constexpr int kReach = 6; // pixels
    const auto middle = rays.nearest(pixels.eye, pixels.through(x, y));
    if (!middle)
        return std::nullopt;
    Place place{pixels.eye + static_cast<double>(middle->distance) * pixels.through(x, y), glm::dvec3(0)};
    for (int v = -kReach; v <= kReach; v += 2)
        for (int u = -kReach; u <= kReach; u += 2)
            if (const auto hit = rays.nearest(pixels.eye, pixels.through(x + u, y + v)))
                place.normal += glm::dvec3(hit->face);
    if (glm::length(place.normal) < 1)
        return std::nullopt;
    place.normal = glm::normalize(place.normal);
    return place;
}

Camera look_at(const Place &place, const glm::dvec3 &from, const Camera &view, double distance) {
    Camera camera = view;
    camera.position = place.at + distance * from;
    camera.focal_point = place.at;
    return camera;
}

} // namespace

std::vector<CloseUp> close_ups(const RayCaster &rays, std::span<const Camera> views, double voxel, int width,
                               int height) {
    std::vector<CloseUp> found;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const PixelRays pixels(views[i], width, height);
        const double scale = kPixelsPerVoxel[i % kPixelsPerVoxel.size()];
        const double distance = height / (2 * std::tan(views[i].view_angle / 2)) * voxel / scale;
        constexpr int kTries = 2000;
        for (int attempt = 0; attempt < kTries; ++attempt) { // outwards on a spiral
            const double radius = 0.4 * height * std::sqrt(attempt / static_cast<double>(kTries));
            const auto place = place_at(rays, pixels, width / 2.0 + radius * std::cos(2.4 * attempt),
                                        height / 2.0 + radius * std::sin(2.4 * attempt));
            if (!place)
                continue;
            const glm::dvec3 aside = glm::normalize(glm::cross(place->normal, views[i].up));
            const glm::dvec3 slanted = glm::normalize(place->normal + aside);
            const glm::dvec3 start = place->at + kClearance * voxel * place->normal;
            if (!(std::abs(glm::dot(aside, aside) - 1) < 1e-6) || rays.is_blocked(start, place->normal, distance) ||
                rays.is_blocked(start, slanted, distance))
                continue;
            found.push_back({look_at(*place, place->normal, views[i], distance), scale, false});
            found.push_back({look_at(*place, slanted, views[i], distance), scale, true});
            break;
        }
    }
    return found;
}

} // namespace pbm
