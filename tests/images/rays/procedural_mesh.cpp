#include "procedural_mesh.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <cmath>
#include <functional>
#include <numbers>

namespace pbm {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

// A torus-like sheet of columns x rows quads, closed in both directions. `at` maps (0..1, 0..1) to a position.
// Degenerate triangles are omitted.
TriangleMesh close_sheet(unsigned columns, unsigned rows, const std::function<glm::dvec3(double, double)> &at) {
    TriangleMesh mesh;
    for (unsigned i = 0; i < columns; ++i)
        for (unsigned j = 0; j < rows; ++j)
            mesh.positions.push_back(at(double(i) / columns, double(j) / rows));
    const auto vertex = [&](unsigned i, unsigned j) { return i % columns * rows + j % rows; };
    const auto add = [&](unsigned a, unsigned b, unsigned c) {
        const auto &p = mesh.positions;
        if (glm::length(glm::cross(p[b] - p[a], p[c] - p[a])) > 1e-12)
            mesh.triangles.emplace_back(a, b, c);
    };
    for (unsigned i = 0; i < columns; ++i) {
        for (unsigned j = 0; j < rows; ++j) {
            add(vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1));
            add(vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1));
        }
    }
    return mesh;
}

// Turns a closed profile (radius, height) around the y axis. Seen with y upwards and the axis on the left, the profile
// runs counter-clockwise.
TriangleMesh revolve(unsigned columns, unsigned rows, const std::function<glm::dvec2(double)> &profile) {
    return close_sheet(columns, rows, [&](double u, double v) {
        const glm::dvec2 p = profile(v);
        return glm::dvec3(p.x * std::sin(kTurn * u), p.y, p.x * std::cos(kTurn * u));
    });
}

} // namespace

TriangleMesh make_sphere() {
    // Down the outside and back along the axis, where triangles have no area.
    return revolve(400, 400, [](double v) {
        const double angle = v < 0.75 ? v / 0.75 * kTurn / 2 : (1 - v) / 0.25 * kTurn / 2;
        return v < 0.75 ? 0.5 * glm::dvec2(std::sin(angle), -std::cos(angle)) : glm::dvec2(0, -0.5 * std::cos(angle));
    });
}

TriangleMesh make_torus() {
    return revolve(400, 200,
                   [](double v) { return glm::dvec2(0.35 + 0.15 * std::cos(kTurn * v), 0.15 * std::sin(kTurn * v)); });
}

TriangleMesh make_bowl() {
    return revolve(400, 300, [](double v) {
        // Outside from the axis up to the rim, inside back down, up along the axis.
        if (v < 0.5)
            return 0.5 * glm::dvec2(std::sin(v * kTurn / 2), -std::cos(v * kTurn / 2));
        if (v < 0.95)
            return 0.44 * glm::dvec2(std::sin((0.95 - v) / 0.9 * kTurn / 2), -std::cos((0.95 - v) / 0.9 * kTurn / 2));
        return glm::dvec2(0, -0.44 - 0.06 * (v - 0.95) / 0.05);
    });
}

TriangleMesh make_knot() {
    const auto path = [](double u) {
        const double a = kTurn * u;
        return 0.16 *
               glm::dvec3(std::sin(a) + 2 * std::sin(2 * a), std::cos(a) - 2 * std::cos(2 * a), -std::sin(3 * a));
    };
    return close_sheet(1200, 100, [&](double u, double v) {
        const glm::dvec3 tangent = glm::normalize(path(u + 1e-4) - path(u - 1e-4));
        const glm::dvec3 side = glm::normalize(glm::cross(tangent, glm::dvec3(0.1, 0.2, 1)));
        const glm::dvec3 out = glm::cross(side, tangent);
        return path(u) + 0.06 * (std::cos(kTurn * v) * side + std::sin(kTurn * v) * out);
    });
}

TriangleMesh make_cube() {
    TriangleMesh mesh;
    const glm::dvec3 z = glm::normalize(glm::dvec3(0.2, 0.1, 1));
    const glm::dvec3 x = glm::normalize(glm::cross(glm::dvec3(0.1, 1, 0), z));
    const glm::dvec3 y = glm::cross(z, x);
    for (unsigned i = 0; i < 8; ++i)
        mesh.positions.push_back(0.3 * (i & 1 ? x : -x) + 0.3 * (i & 2 ? y : -y) + 0.3 * (i & 4 ? z : -z));
    const auto quad = [&](unsigned a, unsigned b, unsigned c, unsigned d) {
        mesh.triangles.emplace_back(a, b, c);
        mesh.triangles.emplace_back(a, c, d);
    };
    quad(0, 2, 3, 1);
    quad(4, 5, 7, 6);
    quad(0, 1, 5, 4);
    quad(2, 6, 7, 3);
    quad(0, 4, 6, 2);
    quad(1, 3, 7, 5);
    return mesh;
}

} // namespace pbm
