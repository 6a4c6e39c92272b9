// What every reader of scans promises for any bytes: an Error of one line, or a Surface with arrays of equal length,
// valid indices and finite numbers, and no more elements than bytes.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cmath>
#include <cstddef>
#include <cstdlib>

namespace pbm::test {

inline void require(bool holds) {
    if (!holds)
        std::abort();
}

// Names that the corpora have, and a class, so that measurements are read and points left out.
inline build::ReadOptions with_fields() {
    return {.fields = {"intensity", "classification", "gps_time", "confidence", "quality"}, .dropped_classes{0x80}};
}

// `size`: of the file. `elements`: at most so many per byte.
inline void hold_surface(const Result<build::Surface> &result, std::size_t size, std::size_t elements = 1) {
    if (!result) {
        require(!result.error().message.empty() && result.error().offset <= size);
        for (const char c : result.error().message)
            require(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f);
        return;
    }
    const build::Surface &s = *result;
    const std::size_t count = s.positions.size();
    require(count != 0 && count + s.dropped_vertices <= elements * size + s.vertex_copies);
    build::for_vertex_attributes([&](const auto &values) { require(values.empty() || values.size() == count); }, s);
    build::for_triangle_attributes(
        [&](const auto &values) { require(values.empty() || values.size() == s.triangles.size()); }, s);
    require(s.triangles.size() <= elements * size);
    for (const glm::dvec3 &p : s.positions)
        require(build::is_finite(p));
    for (const glm::uvec3 &t : s.triangles)
        require(t.x < count && t.y < count && t.z < count && t.x != t.y && t.y != t.z && t.x != t.z);
    for (const glm::vec3 &n : s.normals)
        require(build::is_finite(glm::dvec3(n)));
    for (const float radius : s.radii)
        require(radius > 0.0F && std::isfinite(radius));
    for (const std::uint8_t id : s.material_ids)
        require(id < s.materials.size() && s.materials.size() <= kMaxMaterials);
    for (const std::uint16_t id : s.station_ids)
        require(id < s.stations.size() || id == build::kNoStation);
    for (const glm::dvec3 &station : s.stations)
        require(build::is_finite(station));
    require(s.crs.size() <= 4096);
    for (const std::uint16_t id : s.texture_ids)
        require(id < s.textures.size() || id == build::Surface::kNoTexture);
    for (const build::ImageLayer &layer : s.layers)
        for (const std::uint16_t id : layer.ids)
            require(id < s.textures.size() || id == build::Surface::kNoTexture);
    require(s.reflectances.size() <= s.materials.size());
    for (const build::SceneView &view : s.views)
        require(build::is_finite(view.position) && build::is_finite(view.focal_point) && build::is_finite(view.up) &&
                view.view_angle > 0 && view.view_angle < 3.2);
    for (const glm::vec4 &tangent : s.tangents)
        require(build::is_finite(glm::dvec3(tangent)) &&
                (tangent.w == 1 || tangent.w == -1 || tangent == glm::vec4(0)));
}

} // namespace pbm::test
