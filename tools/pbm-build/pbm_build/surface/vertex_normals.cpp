#include "pbm_build/surface/vertex_normals.h"

#include "pbm_build/surface/face_normal.h"
#include "system/threads/parallel.h"

#include <glm/gtc/type_precision.hpp>

#include <algorithm>
#include <atomic>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 65536;
constexpr double kFaceScale = 1 << 20; // of a unit normal in the sums

std::vector<glm::i64vec3> sum_face_normals(const Surface &surface) {
    std::vector<glm::i64vec3> sums(surface.positions.size(), glm::i64vec3(0));
    for (const glm::uvec3 &t : surface.triangles) {
        const glm::dvec3 n = face_normal(surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]);
        const double length = glm::length(n);
        if (!(length > 0))
            continue;
        for (int axis = 0; axis < 3; ++axis) {
            const double unit = n[axis] / length * kFaceScale;
            const auto vote = static_cast<std::int64_t>(unit < 0 ? unit - 0.5 : unit + 0.5);
            for (int corner = 0; corner < 3; ++corner)
                sums[t[corner]][axis] += vote;
        }
    }
    return sums;
}

bool given_normals_disagree(const Surface &surface, const std::vector<ShortNormal> &given, int threads) {
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

} // namespace

VertexNormals vertex_normals(const Surface &surface, int threads) {
    VertexNormals result;
    result.normals.resize(surface.positions.size());
    if (!surface.normals.empty()) {
        for (std::size_t i = 0; i < surface.normals.size(); ++i)
            result.normals[i] = to_short_normal(glm::dvec3(surface.normals[i]));
        result.faces_point_inward = given_normals_disagree(surface, result.normals, threads);
    }
    const bool complete =
        !surface.normals.empty() && std::none_of(result.normals.begin(), result.normals.end(), is_zero);
    if (complete || surface.triangles.empty())
        return result;

    const std::vector<glm::i64vec3> sums = sum_face_normals(surface);
    const double sign = result.faces_point_inward ? -1 : 1;
    for (std::size_t i = 0; i < sums.size(); ++i)
        if (is_zero(result.normals[i]))
            result.normals[i] = to_short_normal(sign * glm::dvec3(sums[i]));
    return result;
}

} // namespace pbm::build
