// Small meshes, and what --mesh-report and repairs say of them.
#pragma once

#include "pbm_build/mesh_repair/repair_mesh.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace pbm::test {

using namespace pbm::build;

// A cube of edge 1 at `corner`: faces 0 and 1 are those at its lowest x.
inline Surface box(glm::dvec3 corner = glm::dvec3(0)) {
    Surface surface;
    for (int i = 0; i < 8; ++i)
        surface.positions.push_back(corner + glm::dvec3(i & 1, i >> 1 & 1, i >> 2));
    surface.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                         {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    return surface;
}

// Each face with corners of its own, as where normals or texture coordinates are split.
inline Surface split(const Surface &surface) {
    Surface result;
    for (const glm::uvec3 &t : surface.triangles) {
        const auto first = static_cast<std::uint32_t>(result.positions.size());
        for (int corner = 0; corner < 3; ++corner)
            result.positions.push_back(surface.positions[t[corner]]);
        result.triangles.emplace_back(first, first + 1, first + 2);
    }
    return result;
}

inline void append_faces(Surface &to, const Surface &other) {
    const auto first = static_cast<std::uint32_t>(to.positions.size());
    to.positions.insert(to.positions.end(), other.positions.begin(), other.positions.end());
    for (const glm::uvec3 &t : other.triangles)
        to.triangles.push_back(t + first);
}

// A strip of `quads` quads around the z axis that is turned by `halves` half turns.
inline Surface strip(unsigned quads, unsigned halves) {
    Surface surface;
    const double step = 2 * std::acos(-1.0) / quads;
    for (unsigned i = 0; i < quads; ++i)
        for (const double side : {-0.3, 0.3}) {
            const double around = i * step, tilt = around * halves / 2, r = 1 + side * std::cos(tilt);
            surface.positions.emplace_back(r * std::cos(around), r * std::sin(around), side * std::sin(tilt));
        }
    for (unsigned i = 0; i < quads; ++i) {
        const bool crosses = i + 1 == quads && halves % 2 == 1;
        const unsigned a = 2 * i, b = a + 1, c = (a + 2) % (2 * quads), d = c + 1;
        surface.triangles.emplace_back(a, crosses ? d : c, b);
        surface.triangles.emplace_back(b, crosses ? d : c, crosses ? c : d);
    }
    return surface;
}

// The same faces, with vertices and faces in another order and with other first corners.
inline Surface shuffled(const Surface &surface, unsigned seed) {
    std::mt19937 random(seed);
    const auto order_of = [&](std::size_t count) {
        std::vector<std::uint32_t> order(count);
        std::iota(order.begin(), order.end(), 0U);
        std::shuffle(order.begin(), order.end(), random);
        return order;
    };
    const auto arrange = [](const std::vector<std::uint32_t> &order) {
        return [&order](auto &to, const auto &from) {
            for (std::size_t i = 0; i < from.size(); ++i)
                to[order[i]] = from[i];
        };
    };
    const std::vector<std::uint32_t> vertices = order_of(surface.positions.size()),
                                     faces = order_of(surface.triangles.size());
    Surface result = surface;
    arrange(vertices)(result.positions, surface.positions);
    for_vertex_attributes(arrange(vertices), result, surface);
    arrange(faces)(result.triangles, surface.triangles);
    for_triangle_attributes(arrange(faces), result, surface);
    for (std::size_t i = 0; i < result.triangles.size(); ++i) {
        glm::uvec3 &t = result.triangles[i];
        t = {vertices[t.x], vertices[t.y], vertices[t.z]};
        if (random() % 2 == 0)
            continue;
        t = {t.y, t.z, t.x};
        const auto rotate = [i](std::vector<TextureCorners> &corners) {
            if (!corners.empty())
                std::rotate(corners[i].begin(), corners[i].begin() + 1, corners[i].end());
        };
        rotate(result.texture_corners);
        for (ImageLayer &layer : result.layers)
            rotate(layer.corners);
    }
    return result;
}

inline MeshFigures figures(Surface surface) {
    BuildStatistics statistics;
    const Status status = repair_mesh(surface, {.report = true}, 1, statistics);
    EXPECT_TRUE(status.ok());
    EXPECT_EQ(statistics.meshes.size(), 1U);
    return statistics.meshes.empty() ? MeshFigures{} : statistics.meshes.front();
}

inline AttributeReport repaired(Surface &surface, const MeshRequest &request) {
    BuildStatistics statistics;
    const Status status = repair_mesh(surface, request, 1, statistics);
    EXPECT_TRUE(status.ok()) << (status.ok() ? "" : status.error().message);
    EXPECT_EQ(statistics.attributes.size(), 1U);
    return statistics.attributes.empty() ? AttributeReport{} : statistics.attributes.front();
}

// The volume that the faces enclose; negative if they look inwards.
inline double volume(const Surface &surface) {
    double sum = 0;
    for (const glm::uvec3 &t : surface.triangles)
        sum += glm::dot(surface.positions[t.x], glm::cross(surface.positions[t.y], surface.positions[t.z])) / 6;
    return sum;
}

} // namespace pbm::test
