#include "pbm_scan/surface/surface.h"

#include <cstddef>
#include <limits>

namespace pbm::build {
namespace {

constexpr std::uint32_t kGone = std::numeric_limits<std::uint32_t>::max();

// Only a finite number gives zero here: infinity - infinity is NaN.
bool finite(const glm::dvec3 &p) { return (p.x - p.x) + (p.y - p.y) + (p.z - p.z) == 0.0; }

template <class T> void compact(std::vector<T> &values, const std::vector<std::uint32_t> &new_index) {
    if (values.empty())
        return;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
        if (new_index[i] != kGone)
            values[kept++] = values[i];
    values.resize(kept);
}

void renumber_triangles(Surface &surface, const std::vector<std::uint32_t> &new_index) {
    std::size_t kept = 0;
    for (const glm::uvec3 t : surface.triangles) {
        const glm::uvec3 moved(new_index[t.x], new_index[t.y], new_index[t.z]);
        if (moved.x != kGone && moved.y != kGone && moved.z != kGone)
            surface.triangles[kept++] = moved;
    }
    surface.dropped_triangles += surface.triangles.size() - kept;
    surface.triangles.resize(kept);
}

Status drop_non_finite(Surface &surface) {
    std::size_t bad = 0;
    for (const glm::dvec3 &p : surface.positions)
        bad += finite(p) ? 0U : 1U;
    if (bad == surface.positions.size())
        return Error{ErrorCode::bad_input, 0,
                     bad == 0 ? "the file has no vertices: there is nothing to build"
                              : "no vertex has finite coordinates: there is nothing to build"};
    if (bad == 0)
        return {};

    std::vector<std::uint32_t> new_index(surface.positions.size(), kGone);
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < new_index.size(); ++i)
        if (finite(surface.positions[i]))
            new_index[i] = next++;
    renumber_triangles(surface, new_index);
    compact(surface.positions, new_index);
    for_vertex_attributes([&](auto &values) { compact(values, new_index); }, surface);
    surface.dropped_vertices += bad;
    return {};
}

Status refuse_drops(const Surface &surface) {
    for (const AttributeReport &line : surface.report)
        if (line.fate == AttributeReport::Fate::dropped)
            return Error{ErrorCode::bad_input, 0,
                         "--strict: " + line.name + " would be dropped (" + line.note +
                             "); remove it from the scan or leave --strict out"};
    if (surface.dropped_vertices != 0)
        return Error{ErrorCode::bad_input, 0,
                     "--strict: " + std::to_string(surface.dropped_vertices) +
                         " vertices have coordinates that are not finite; clean the scan or leave --strict out"};
    if (surface.dropped_triangles != 0)
        return Error{ErrorCode::bad_input, 0,
                     "--strict: " + std::to_string(surface.dropped_triangles) +
                         " triangles are degenerate; clean the scan or leave --strict out"};
    return {};
}

} // namespace

Result<Surface> finished(Surface surface, const ReadOptions &options) {
    if (Status status = drop_non_finite(surface); !status)
        return std::move(status).error();
    if (options.strict)
        if (Status status = refuse_drops(surface); !status)
            return std::move(status).error();
    return surface;
}

} // namespace pbm::build
