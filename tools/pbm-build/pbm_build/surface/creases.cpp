#include "pbm_build/surface/creases.h"

#include "pbm_build/surface/corner_normals.h"
#include "pbm_build/surface/face_normal.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <utility>

namespace pbm::build {
namespace {

bool declares_all_normals(const Surface &surface) {
    return !surface.normals.empty() && std::none_of(surface.normals.begin(), surface.normals.end(),
                                                    [](const glm::vec3 &n) { return n == glm::vec3(0.0F); });
}

} // namespace

void choose_creases(Surface &surface, std::optional<double> requested, int threads, BuildStatistics &statistics) {
    if (requested) {
        surface.crease_angle = glm::radians(*requested);
        surface.smoothing_groups.clear();
        if (surface.triangles.empty() || declares_all_normals(surface))
            statistics.report(Warning::idle_option, "--crease-angle",
                              surface.triangles.empty() ? "there are no faces" : "the file declares its normals",
                              surface.name);
        return;
    }
    if (!surface.has_facets || surface.triangles.empty())
        return;
    const double share = planar_share(surface, threads);
    const bool are_flat = surface.triangles.size() < kFewFacets || share >= kMinPlanarShare;
    if (are_flat)
        surface.crease_angle = 0;
    statistics.report(
        "facets", Fate::kept,
        formatted("%zu, %.0f %% of the area in planes of several: ", surface.triangles.size(), 100 * share) +
            (are_flat
                 ? formatted("each keeps its own normal; --crease-angle %.0f shades them smoothly", kConstructedCrease)
                 : "shaded smoothly, as a scan; --crease-angle 0 gives each its own normal"),
        surface.name);
}

void separate_facets(Surface &surface) {
    const std::vector<glm::uvec3> triangles = std::exchange(surface.triangles, {});
    const auto separate = [&](auto &values) {
        if (values.empty())
            return;
        std::remove_cvref_t<decltype(values)> corners;
        corners.reserve(3 * triangles.size());
        for (const glm::uvec3 &t : triangles)
            corners.insert(corners.end(), {values[t.x], values[t.y], values[t.z]});
        values = std::move(corners);
    };
    separate(surface.positions);
    for_vertex_attributes(separate, surface);
    surface.normals.clear();
    for (std::uint32_t i = 0; i < surface.positions.size(); i += 3) {
        surface.triangles.emplace_back(i, i + 1, i + 2);
        const std::span<const glm::dvec3> corners = std::span(surface.positions).subspan(i, 3);
        const glm::dvec3 normal = face_normal(corners[0], corners[1], corners[2]);
        const double length = glm::length(normal);
        surface.normals.resize(i + 3, length > 0 ? glm::vec3(normal / length) : glm::vec3(0.0F));
    }
    surface.crease_angle.reset();
}

} // namespace pbm::build
