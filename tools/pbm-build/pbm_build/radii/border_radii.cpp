#include "pbm_build/radii/border_radii.h"

#include "pbm_build/lattice/lattice.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_build/radii/tangent_cell.h"
#include "pbm_build/winding/edge_joins.h"
#include "pbm_format/model/normal.h"
#include "pbm_format/model/point_values.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

namespace pbm::build {
namespace {

constexpr std::size_t kEdgesOfBlock = 256, kVoxelsOfBlock = 1024;
constexpr std::size_t kVoxelsPerEdge = 16; // fewer: the faces are loose
constexpr double kLeastRadius = 0.05, kScallops = 0.05;
constexpr double kReach = 0.87; // voxels; splats of points that are farther inside end there, or nearly
constexpr double kSameFace = 0.7, kMaxHeight = 0.9; // cosine between normals of point and face; edge over its plane
constexpr int kAround = 2;        // voxels; with kReach and kBeyond: some lie behind every border that goes on
constexpr double kMinLean = 0.25; // of the mean of their places, where they lie on one side
constexpr double kBeyond = 1;     // a voxel that reaches so far over the border is none of the border's

// The number of the voxel at `place`, which lies in the grid.
std::optional<std::size_t> find_voxel(const Voxels &voxels, const glm::ivec3 &place) {
    const MortonCode code = code_of(place);
    const auto at = std::lower_bound(voxels.codes.begin(), voxels.codes.end(), code);
    if (at == voxels.codes.end() || *at != code)
        return {};
    return static_cast<std::size_t>(at - voxels.codes.begin());
}

// Calls `work(place)` for the places of a box, corners included, that lie in the grid.
template <class Work> void for_box(const glm::ivec3 &first, const glm::ivec3 &last, int grid_edge, const Work &work) {
    const glm::ivec3 from = glm::max(first, 0), to = glm::min(last, grid_edge - 1);
    for (int z = from.z; z <= to.z; ++z)
        for (int y = from.y; y <= to.y; ++y)
            for (int x = from.x; x <= to.x; ++x)
                work(glm::ivec3(x, y, z));
}

TangentPlane plane_of(const Voxels &voxels, std::size_t voxel) {
    const UnitVector &n = normal_table()[voxels.points.normals[voxel] & kNormalIndexMask];
    return TangentPlane({n[0], n[1], n[2]});
}

// An edge with one face. Lengths are in voxels.
struct BorderEdge {
    glm::dvec3 start, along; // from the corner of the grid; to the edge's end
    glm::dvec3 face;         // unit normal
    glm::dvec3 outward;      // in the plane of the face, of any length

    glm::dvec3 nearest_to(const glm::dvec3 &place) const {
        return start + along * std::clamp(glm::dot(place - start, along) / glm::dot(along, along), 0.0, 1.0);
    }
};

// Nothing for a face without an area.
std::optional<BorderEdge> border_edge(const Surface &surface, HalfEdge side, const Grid &grid) {
    const auto corner = [&](HalfEdge h) {
        const glm::dvec3 position = surface.positions[surface.triangles[h / 3][static_cast<int>(h % 3)]];
        return (position - vector_of(grid.origin)) / grid.voxel_size;
    };
    BorderEdge edge{.start = corner(side), .along = {}, .face = {}, .outward = {}};
    edge.along = corner(next_side(side)) - edge.start;
    edge.face = glm::cross(edge.along, corner(previous_side(side)) - edge.start);
    const double twice_area = glm::length(edge.face);
    if (!(twice_area > 0))
        return {};
    edge.face /= twice_area;
    edge.outward = glm::cross(edge.along, edge.face);
    return edge;
}

// A voxel near an edge.
struct AtBorder {
    std::size_t voxel;
    double distance; // in the tangent plane
    std::uint8_t radius;

    auto order() const { return std::tie(voxel, distance, radius); }
};

// How the voxel with this centre lies to an edge; nothing if the edge is none of its surface.
std::optional<AtBorder> at_border(const Voxels &voxels, std::size_t voxel, const glm::dvec3 &centre,
                                  const BorderEdge &edge, int grid_edge) {
    if (voxels.points.normals[voxel] == kNoNormal)
        return {};
    const TangentPlane plane = plane_of(voxels, voxel);
    const glm::dvec3 to_centre = centre - edge.nearest_to(centre);
    if (std::fabs(plane.height(edge.face)) < kSameFace || std::fabs(plane.height(to_centre)) > kMaxHeight)
        return {};
    const double distance = glm::length(plane.flat(to_centre));
    if (distance > kReach)
        return {};
    const bool is_inside = glm::dot(to_centre, edge.outward) <= 0;
    const double radius = is_inside ? std::sqrt(distance * distance + kScallops) : kLeastRadius;
    return AtBorder{voxel, distance, radius_index(radius / grid_edge)};
}

// Appends the voxels near an edge.
void find_at_border(const Voxels &voxels, const BorderEdge &edge, int grid_edge, std::vector<AtBorder> &found) {
    constexpr double kFarthest = 1.3; // from the edge: sqrt(kReach^2 + kMaxHeight^2) and more
    const int pieces = static_cast<int>(glm::length(edge.along)) + 1;
    for (int piece = 0; piece < pieces; ++piece) {
        const auto end_of = [&](int k) { return edge.start + edge.along * (static_cast<double>(k) / pieces); };
        const glm::dvec3 a = end_of(piece), b = end_of(piece + 1);
        const glm::ivec3 first(glm::floor(glm::min(a, b) - kFarthest)), last(glm::floor(glm::max(a, b) + kFarthest));
        for_box(first, last, grid_edge, [&](const glm::ivec3 &place) {
            const glm::dvec3 centre = glm::dvec3(place) + 0.5, off = centre - edge.nearest_to(centre);
            if (glm::dot(off, off) > kFarthest * kFarthest)
                return;
            if (const auto voxel = find_voxel(voxels, place))
                if (const auto one = at_border(voxels, *voxel, centre, edge, grid_edge))
                    found.push_back(*one);
        });
    }
}

// Whether the voxels around one lie on all sides of it, or on both sides of its border.
bool surface_continues(const Voxels &voxels, std::size_t voxel, double radius, int grid_edge) {
    const TangentPlane plane = plane_of(voxels, voxel);
    const auto code = morton_decode(voxels.codes[voxel]);
    const glm::ivec3 centre(code[0], code[1], code[2]);
    std::vector<glm::dvec2> &around = per_thread<std::vector<glm::dvec2>>();
    around.clear();
    glm::dvec2 sum(0);
    for_box(centre - kAround, centre + kAround, grid_edge, [&](const glm::ivec3 &place) {
        const glm::dvec3 offset(place - centre);
        if (std::fabs(plane.height(offset)) < 1 && find_voxel(voxels, place))
            sum += around.emplace_back(plane.flat(offset));
    });
    const double lean = glm::length(sum);
    if (lean <= kMinLean * static_cast<double>(around.size()))
        return true;
    const glm::dvec2 outward = -sum / lean;
    const double border = std::sqrt(std::max(0.0, radius * radius - kScallops));
    return std::any_of(around.begin(), around.end(), [&](const glm::dvec2 &at) {
        const double out = glm::dot(at, outward);
        return out > border + kBeyond && glm::length(at - out * outward) < 1;
    });
}

} // namespace

void shrink_at_borders(const Surface &surface, const Grid &grid, Voxels &voxels, int threads) {
    const std::vector<HalfEdge> open = join_edges(surface, threads).open;
    if (open.size() > voxels.codes.size() / kVoxelsPerEdge)
        return;
    std::vector<std::vector<AtBorder>> found((open.size() + kEdgesOfBlock - 1) / kEdgesOfBlock);
    parallel_blocks(open.size(), kEdgesOfBlock, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (const auto edge = border_edge(surface, open[i], grid))
                find_at_border(voxels, *edge, 1 << grid.depth, found[begin / kEdgesOfBlock]);
    });
    std::vector<AtBorder> all;
    for (std::vector<AtBorder> &some : found)
        all.insert(all.end(), some.begin(), some.end());
    std::sort(all.begin(), all.end(), [](const AtBorder &a, const AtBorder &b) { return a.order() < b.order(); });
    Bytes &radii = voxels.points.radii;
    const std::uint8_t dense = dense_radius(grid.depth);
    for (std::size_t i = 0; i < all.size(); ++i)
        if (i == 0 || all[i].voxel != all[i - 1].voxel) // the nearest edge
            radii[all[i].voxel] = std::min(all[i].radius, dense);
}

bool ends_at_border(std::uint8_t radius, int depth) { return radius > 0 && radius < dense_radius(depth); }

void restore_where_surface_continues(Voxels &voxels, int depth, int threads) {
    std::vector<std::size_t> shrunk;
    for (std::size_t i = 0; i < voxels.codes.size(); ++i)
        if (ends_at_border(voxels.points.radii[i], depth))
            shrunk.push_back(i);
    const int grid_edge = 1 << depth;
    parallel_for(shrunk.size(), kVoxelsOfBlock, threads, [&](std::size_t i) {
        std::uint8_t &radius = voxels.points.radii[shrunk[i]];
        if (surface_continues(voxels, shrunk[i], radius_fraction(radius) * grid_edge, grid_edge))
            radius = dense_radius(depth);
    });
}

} // namespace pbm::build
