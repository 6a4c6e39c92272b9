#include "pbm_build/mesh_repair/welded_mesh.h"

#include <algorithm>
#include <cassert>
#include <tuple>
#include <utility>

namespace pbm::build {
namespace {

void weld_positions(const Surface &surface, WeldedMesh &mesh) {
    const std::vector<glm::dvec3> &all = surface.positions;
    struct VertexKey {
        double x;
        std::uint32_t index;
    };
    std::vector<VertexKey> order(all.size());
    for (std::uint32_t i = 0; i < order.size(); ++i)
        order[i] = {all[i].x, i};
    std::sort(order.begin(), order.end(), [&](const VertexKey &a, const VertexKey &b) {
        if (a.x != b.x)
            return a.x < b.x;
        const glm::dvec3 &p = all[a.index], &q = all[b.index];
        return p.y != q.y ? p.y < q.y : p.z < q.z;
    });
    mesh.vertex_of.resize(all.size());
    for (const VertexKey &key : order) {
        const glm::dvec3 &p = all[key.index];
        if (mesh.positions.empty() || mesh.positions.back() != p)
            mesh.positions.push_back(p);
        mesh.vertex_of[key.index] = static_cast<std::uint32_t>(mesh.positions.size() - 1);
    }
}

// The vertices of a face in ascending order, then whether the last two run the other way in the face.
auto key(const WeldedMesh::Face &face) {
    const auto [a, b, c] = face.corners;
    return std::tuple(a, std::min(b, c), std::max(b, c), b > c);
}
bool same_vertices(const WeldedMesh::Face &f, const WeldedMesh::Face &g) {
    const auto [a, b, c] = f.corners;
    const auto [i, j, k] = g.corners;
    return a == i && std::min(b, c) == std::min(j, k) && std::max(b, c) == std::max(j, k);
}

void collect_faces(const Surface &surface, WeldedMesh &mesh) {
    mesh.faces.reserve(surface.triangles.size());
    for (std::uint32_t i = 0; i < surface.triangles.size(); ++i) {
        const glm::uvec3 &t = surface.triangles[i];
        std::array corners{mesh.vertex_of[t.x], mesh.vertex_of[t.y], mesh.vertex_of[t.z]};
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0])
            mesh.flat.push_back(i);
        else
            mesh.faces.push_back({corners, i});
    }
    std::sort(mesh.faces.begin(), mesh.faces.end(), [](const WeldedMesh::Face &f, const WeldedMesh::Face &g) {
        return std::pair(key(f), f.triangle) < std::pair(key(g), g.triangle);
    });
    std::size_t kept = 0;
    for (const WeldedMesh::Face &face : mesh.faces) {
        if (kept == 0 || !same_vertices(mesh.faces[kept - 1], face)) {
            mesh.faces[kept++] = face;
            mesh.both_ways.push_back(0);
            continue;
        }
        mesh.repeated.push_back({face.triangle, static_cast<std::uint32_t>(kept - 1)});
        if (face.corners != mesh.faces[kept - 1].corners)
            mesh.both_ways.back() = 1;
    }
    mesh.faces.resize(kept);
}

struct Side {
    std::uint32_t end; // the larger vertex
    HalfEdge side;
};

// The sides at one edge.
void join_sides(std::span<const Side> sides, WeldedMesh &mesh) {
    ++mesh.edges;
    if (sides.size() == 2) {
        mesh.mates[sides[0].side] = sides[1].side;
        mesh.mates[sides[1].side] = sides[0].side;
    } else if (sides.size() == 1) {
        ++mesh.boundary_edges;
    } else {
        ++mesh.complex_edges;
        for (const Side &side : sides) {
            mesh.mates[side.side] = kComplex;
            mesh.complex_sides.push_back({side.side, sides[0].side});
        }
    }
}

// Sorts all sides by their smaller vertex, then those of one vertex by the larger one.
void find_mates(WeldedMesh &mesh) {
    const auto sides = static_cast<HalfEdge>(3 * mesh.faces.size());
    const auto smaller = [&](HalfEdge h) { return std::min(mesh.from(h), mesh.to(h)); };
    std::vector<std::uint32_t> starts(mesh.positions.size() + 1);
    for (HalfEdge h = 0; h < sides; ++h)
        ++starts[smaller(h) + 1];
    for (std::size_t i = 1; i < starts.size(); ++i)
        starts[i] += starts[i - 1];
    std::vector<Side> sorted(sides);
    std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
    for (HalfEdge h = 0; h < sides; ++h)
        sorted[next[smaller(h)]++] = {std::max(mesh.from(h), mesh.to(h)), h};
    mesh.mates.assign(sides, kBoundary);
    for (std::size_t vertex = 0; vertex + 1 < starts.size(); ++vertex) {
        const auto begin = sorted.begin() + starts[vertex], end = sorted.begin() + starts[vertex + 1];
        std::sort(begin, end,
                  [](const Side &a, const Side &b) { return std::pair(a.end, a.side) < std::pair(b.end, b.side); });
        for (auto at = begin; at != end;) {
            const auto after = std::find_if(at, end, [&](const Side &side) { return side.end != at->end; });
            join_sides({at, after}, mesh);
            at = after;
        }
    }
}

} // namespace

WeldedMesh weld(const Surface &surface) {
    assert(surface.triangles.size() <= kMaxMeshFaces);
    WeldedMesh mesh;
    weld_positions(surface, mesh);
    collect_faces(surface, mesh);
    find_mates(mesh);
    return mesh;
}

} // namespace pbm::build
