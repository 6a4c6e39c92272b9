#include "pbm_build/mesh_repair/half_edges.h"

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>

#include <algorithm>

namespace pbm::build {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

using TriMesh = OpenMesh::TriConnectivity; // without positions

VertexHandle vertex_handle(std::size_t index) { return VertexHandle(static_cast<int>(index)); }
std::size_t index_of(OpenMesh::BaseHandle handle) { return static_cast<std::size_t>(handle.idx()); }

// The corners of all faces, joined where they meet in one fan. Corner h is where side h begins.
JoinedSets fans_of(const WeldedMesh &mesh, std::span<const std::array<HalfEdge, 2>> also) {
    JoinedSets corners(mesh.mates.size());
    const auto join = [&](HalfEdge h, HalfEdge mate) {
        const bool opposite = mesh.from(h) != mesh.from(mate);
        corners.join(h, opposite ? next_side(mate) : mate);
        corners.join(next_side(h), opposite ? mate : next_side(mate));
    };
    for (HalfEdge h = 0; h < mesh.mates.size(); ++h)
        if (is_mate(mesh.mates[h]) && h < mesh.mates[h])
            join(h, mesh.mates[h]);
    for (const auto &[h, mate] : also)
        join(h, mate);
    return corners;
}

std::uint64_t count_complex_vertices(const WeldedMesh &mesh, JoinedSets &fans) {
    std::vector<std::uint8_t> seen(mesh.positions.size());
    std::uint64_t complex = 0;
    for (HalfEdge h = 0; h < mesh.mates.size(); ++h)
        if (fans.find(h) == h) {
            std::uint8_t &count = seen[mesh.from(h)];
            complex += count == 1 ? 1 : 0;
            count = static_cast<std::uint8_t>(std::min(count + 1, 2));
        }
    return complex;
}

// The mesh, cut, with a vertex for each fan. Built from the known neighbours: TriMesh::add_face would search for them,
// and refuses faces that are added in an unlucky order.
struct CutMesh {
    TriMesh half_edges;
    std::vector<HalfEdge> side_of;        // [half-edges of OpenMesh]; of a border half-edge: the side on its right
    std::vector<std::uint32_t> vertex_of; // [vertices of OpenMesh] in the welded mesh

    CutMesh(const WeldedMesh &mesh, const Sheets &sheets, JoinedSets &fans) {
        std::vector<std::uint32_t> fan_vertex(mesh.mates.size());
        for (HalfEdge h = 0; h < mesh.mates.size(); ++h)
            if (const std::uint32_t fan = fans.find(h); fan == h) { // the smallest of its fan comes first
                fan_vertex[h] = static_cast<std::uint32_t>(vertex_of.size());
                vertex_of.push_back(mesh.from(h));
            } else {
                fan_vertex[h] = fan_vertex[fan];
            }
        half_edges.reserve(vertex_of.size(), mesh.edges, mesh.faces.size());
        for (std::size_t i = 0; i < vertex_of.size(); ++i)
            half_edges.new_vertex();
        std::vector<HalfedgeHandle> handles(mesh.mates.size());
        for (HalfEdge h = 0; h < mesh.mates.size(); ++h) {
            if (handles[h].is_valid())
                continue;
            const bool turned = sheets.turned[h / 3] != 0;
            const VertexHandle from = vertex_handle(fan_vertex[turned ? next_side(h) : h]),
                               to = vertex_handle(fan_vertex[turned ? h : next_side(h)]);
            handles[h] = half_edges.new_edge(from, to);
            const HalfedgeHandle opposite = half_edges.opposite_halfedge_handle(handles[h]);
            half_edges.set_halfedge_handle(from, handles[h]);
            half_edges.set_halfedge_handle(to, opposite);
            const HalfEdge mate = mesh.mates[h];
            if (is_mate(mate))
                handles[mate] = opposite;
            side_of.insert(side_of.end(), {h, is_mate(mate) ? mate : h});
        }
        for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
            const FaceHandle face = half_edges.new_face();
            const std::span<const HalfedgeHandle> sides = std::span(handles).subspan(3 * i, 3);
            half_edges.set_halfedge_handle(face, sides[0]);
            for (std::size_t side = 0; side < 3; ++side) {
                half_edges.set_face_handle(sides[side], face);
                half_edges.set_next_halfedge_handle(sides[side], sides[(side + (sheets.turned[i] != 0 ? 2 : 1)) % 3]);
            }
        }
        link_border();
    }

  private:
    // At each vertex of the border one half-edge of it arrives and one leaves.
    void link_border() {
        for (const auto border : half_edges.halfedges())
            if (half_edges.is_boundary(border))
                half_edges.set_halfedge_handle(half_edges.from_vertex_handle(border), border);
        for (const auto border : half_edges.halfedges())
            if (half_edges.is_boundary(border))
                half_edges.set_next_halfedge_handle(border,
                                                    half_edges.halfedge_handle(half_edges.to_vertex_handle(border)));
    }
};

// Splits walks along the border into loops.
class LoopCutter {
  public:
    LoopCutter(const WeldedMesh &mesh, const CutMesh &cut, std::vector<Loop> &loops)
        : mesh_(mesh), cut_(cut), loops_(loops), place_of_(mesh.positions.size(), kNowhere) {}

    void step(HalfedgeHandle border) {
        const std::uint32_t vertex = vertex_at(border);
        if (place_of_[vertex] != kNowhere)
            finish(place_of_[vertex]);
        place_of_[vertex] = static_cast<std::uint32_t>(path_.size());
        path_.push_back(border);
    }
    void finish() { finish(0); }

  private:
    static constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

    std::uint32_t vertex_at(HalfedgeHandle border) const {
        return cut_.vertex_of[index_of(cut_.half_edges.from_vertex_handle(border))];
    }

    // Takes the loop that begins at path_[begin] off the path.
    void finish(std::size_t begin) {
        Loop loop;
        for (const HalfedgeHandle border : std::span(path_).subspan(begin)) {
            loop.sides.push_back(cut_.side_of[index_of(border)]);
            loop.open_sides += mesh_.mates[loop.sides.back()] == kBoundary ? 1 : 0;
            place_of_[vertex_at(border)] = kNowhere;
        }
        if (loop.open_sides > 0)
            loops_.push_back(std::move(loop));
        path_.resize(begin);
    }

    const WeldedMesh &mesh_;
    const CutMesh &cut_;
    std::vector<Loop> &loops_;
    std::vector<std::uint32_t> place_of_; // [vertices] on the path
    std::vector<HalfedgeHandle> path_;
};

} // namespace

Borders find_borders(const WeldedMesh &mesh, const Sheets &sheets) {
    Borders borders;
    JoinedSets fans = fans_of(mesh, sheets.cuts);
    borders.complex_vertices = count_complex_vertices(mesh, fans);
    if (!sheets.cuts.empty())
        fans = fans_of(mesh, {});
    const CutMesh cut(mesh, sheets, fans);
    LoopCutter cutter(mesh, cut, borders.loops);
    std::vector<bool> done(cut.half_edges.n_halfedges());
    for (const auto first : cut.half_edges.halfedges())
        if (cut.half_edges.is_boundary(first) && !done[index_of(first)]) {
            for (HalfedgeHandle h = first; !done[index_of(h)]; h = cut.half_edges.next_halfedge_handle(h)) {
                done[index_of(h)] = true;
                cutter.step(h);
            }
            cutter.finish();
        }
    return borders;
}

} // namespace pbm::build
