#include "pbm_build/surface/vertex_normals.h"

#include "pbm_build/surface/corner_normals.h"
#include "pbm_build/surface/face_normal.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 65536;

bool disagree(const Surface &surface, const std::vector<ShortNormal> &given, int threads) {
    std::atomic<std::int64_t> balance{0};
    parallel_blocks(surface.triangles.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
        std::int64_t agree = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const glm::uvec3 &t = surface.triangles[i];
            const glm::dvec3 n = face_normal(surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]);
            double along = 0;
            for (int corner = 0; corner < 3; ++corner)
                for (int axis = 0; axis < 3; ++axis)
                    along += n[axis] * given[t[corner]][static_cast<std::size_t>(axis)];
            agree += along > 0 ? 1 : along < 0 ? -1 : 0;
        }
        balance += agree;
    });
    return balance < 0;
}

std::vector<ShortNormal> given_normals(const Surface &surface) {
    std::vector<ShortNormal> given(surface.positions.size());
    for (std::size_t i = 0; i < surface.normals.size(); ++i)
        given[i] = to_short_normal(glm::dvec3(surface.normals[i]));
    return given;
}

} // namespace

bool faces_point_inward(const Surface &surface, int threads) {
    return !surface.normals.empty() && disagree(surface, given_normals(surface), threads);
}

Result<VertexNormals> vertex_normals(Surface &surface, int threads) {
    VertexNormals result;
    result.normals = given_normals(surface);
    result.faces_point_inward = !surface.normals.empty() && disagree(surface, result.normals, threads);
    const bool complete =
        !surface.normals.empty() && std::none_of(result.normals.begin(), result.normals.end(), is_zero);
    if (complete || surface.triangles.empty() || surface.crease_angle == 0.0)
        return result;
    if (Status added = add_corner_normals(surface, result.normals, result.faces_point_inward ? -1 : 1, threads); !added)
        return added.error();
    return result;
}

} // namespace pbm::build
