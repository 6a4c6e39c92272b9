#include "surface_look.h"

#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

// A vertex on a right-angled edge has a normal exactly 45 degrees from both faces: that is a crease.
constexpr double kCreaseCosine = 0.72;

glm::dvec3 unit_normal(const TriangleMesh &mesh, const glm::uvec3 &t) {
    const glm::dvec3 &a = mesh.positions[t.x];
    const glm::dvec3 n = glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a);
    const double length = glm::length(n);
    return length > 0 ? n / length : glm::dvec3(0);
}

} // namespace

SurfaceLook look_of(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals) {
    std::vector<glm::dvec3> sums(mesh.positions.size());
    for (const glm::uvec3 &t : mesh.triangles)
        for (int corner = 0; corner < 3; ++corner)
            sums[t[corner]] += unit_normal(mesh, t);
    SurfaceLook look;
    look.normals.reserve(sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const bool given = !given_normals.empty() && given_normals[i] != glm::vec3(0);
        const glm::dvec3 sum = given ? glm::dvec3(given_normals[i]) : sums[i];
        look.normals.emplace_back(sum == glm::dvec3(0) ? sum : glm::normalize(sum));
    }
    look.is_flat.reserve(mesh.triangles.size());
    for (const glm::uvec3 &t : mesh.triangles) {
        const glm::vec3 face = unit_normal(mesh, t);
        bool flat = false;
        for (int corner = 0; corner < 3; ++corner)
            flat |= glm::dot(face, look.normals[t[corner]]) < kCreaseCosine;
        look.is_flat.push_back(flat);
    }
    return look;
}

bool faces_point_inward(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals) {
    std::int64_t balance = 0;
    if (given_normals.empty())
        return false;
    for (const glm::uvec3 &t : mesh.triangles) {
        const glm::dvec3 sum = given_normals[t.x] + given_normals[t.y] + given_normals[t.z];
        const double along = glm::dot(unit_normal(mesh, t), sum);
        balance += along > 0 ? 1 : along < 0 ? -1 : 0;
    }
    return balance < 0;
}

double to_linear(std::uint8_t srgb) {
    const double v = srgb / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

double to_srgb(double linear) {
    const double v = std::clamp(linear, 0.0, 1.0);
    return 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

} // namespace pbm
