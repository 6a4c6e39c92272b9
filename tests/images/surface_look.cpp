#include "surface_look.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

const double kScannedCosine = std::cos(glm::radians(74.95)), kConstructedCosine = std::cos(glm::radians(43.95));
const double kPlanarSine = std::sin(glm::radians(0.1));
constexpr double kDominantArea = 16;

glm::dvec3 unit_normal(const TriangleMesh &mesh, const glm::uvec3 &t) {
    const glm::dvec3 &a = mesh.positions[t.x];
    const glm::dvec3 n = glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a);
    const double length = glm::length(n);
    return length > 0 ? n / length : glm::dvec3(0);
}

// A face, and the area of all faces that lie in its plane and are connected with it at vertices.
struct Face {
    glm::dvec3 normal{};
    double area = 0;
    std::size_t parent = 0;
};

bool in_one_plane(const Face &a, const Face &b) {
    return glm::dot(a.normal, b.normal) > 0 && glm::length(glm::cross(a.normal, b.normal)) <= kPlanarSine;
}

std::size_t root_of(const std::vector<Face> &faces, std::size_t i) {
    while (faces[i].parent != i)
        i = faces[i].parent;
    return i;
}

using FacesOfVertices = std::vector<std::vector<std::size_t>>;

// Whether 0.3 of the area has a neighbour across an edge in the same plane.
bool is_constructed(const TriangleMesh &mesh, const std::vector<Face> &faces, const FacesOfVertices &at) {
    std::vector<bool> is_planar(faces.size());
    const auto has = [&](std::size_t face, std::uint32_t vertex) {
        const glm::uvec3 &t = mesh.triangles[face];
        return t.x == vertex || t.y == vertex || t.z == vertex;
    };
    for (std::uint32_t vertex = 0; vertex < at.size(); ++vertex)
        for (const std::size_t i : at[vertex])
            for (const std::size_t j : at[vertex])
                for (int corner = 0; corner < 3; ++corner)
                    if (const std::uint32_t other = mesh.triangles[i][corner];
                        i != j && other != vertex && has(j, other) && in_one_plane(faces[i], faces[j]))
                        is_planar[i] = true;
    double planar = 0, all = 0;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        all += faces[i].area;
        planar += is_planar[i] ? faces[i].area : 0;
    }
    return planar >= 0.3 * all;
}

// `area` of all is that of planes if the surface is constructed; 0 if not.
std::vector<Face> faces_of(const TriangleMesh &mesh, const FacesOfVertices &at) {
    std::vector<Face> faces;
    for (const glm::uvec3 &t : mesh.triangles) {
        const glm::dvec3 &a = mesh.positions[t.x];
        faces.push_back({.normal = unit_normal(mesh, t),
                         .area = glm::length(glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a)),
                         .parent = faces.size()});
    }
    if (!is_constructed(mesh, faces, at)) {
        for (Face &face : faces)
            face.area = 0;
        return faces;
    }
    for (const std::vector<std::size_t> &around : at)
        for (const std::size_t i : around)
            for (const std::size_t j : around)
                if (in_one_plane(faces[i], faces[j]))
                    faces[root_of(faces, i)].parent = root_of(faces, j);
    std::vector<double> areas(faces.size()); // of planes
    for (std::size_t i = 0; i < faces.size(); ++i)
        areas[root_of(faces, i)] += faces[i].area;
    for (std::size_t i = 0; i < faces.size(); ++i)
        faces[i].area = areas[root_of(faces, i)];
    return faces;
}

// The normal of a corner of faces[own], whose vertex has the faces `around`.
glm::dvec3 corner_normal(const std::vector<Face> &faces, const std::vector<std::size_t> &around, std::size_t own) {
    std::vector<std::size_t> near;
    double largest = 0;
    const double cosine = faces[own].area > 0 ? kConstructedCosine : kScannedCosine;
    for (const std::size_t i : around)
        if (i == own || glm::dot(faces[i].normal, faces[own].normal) > cosine) {
            near.push_back(i);
            largest = std::max(largest, faces[i].area);
        }
    glm::dvec3 sum(0);
    for (const std::size_t i : near)
        if (faces[i].area * kDominantArea >= largest)
            sum +=
                faces[i].normal / static_cast<double>(std::count_if(around.begin(), around.end(), [&](std::size_t j) {
                    return i == j || (largest > 0 && in_one_plane(faces[i], faces[j]));
                }));
    return sum == glm::dvec3(0) ? sum : glm::normalize(sum);
}

} // namespace

SurfaceLook look_of(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals) {
    FacesOfVertices at(mesh.positions.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (int corner = 0; corner < 3; ++corner)
            at[mesh.triangles[i][corner]].push_back(i);
    const std::vector<Face> faces = faces_of(mesh, at);
    SurfaceLook look;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        std::array<glm::vec3, 3> &normals = look.normals.emplace_back();
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t vertex = mesh.triangles[i][corner];
            const bool given = !given_normals.empty() && given_normals[vertex] != glm::vec3(0);
            normals[static_cast<std::size_t>(corner)] =
                given ? glm::normalize(given_normals[vertex]) : glm::vec3(corner_normal(faces, at[vertex], i));
        }
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
