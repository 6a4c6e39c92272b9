#include "pbm_build/radii/border_radii.h"

#include "pbm_build/lattice/lattice.h"
#include "pbm_build/neighbours/near_voxels.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_build/radii/tangent_cell.h"
#include "pbm_build/winding/edge_joins.h"
#include "pbm_format/model/point_values.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

namespace pbm::build {
namespace {

constexpr std::size_t kEdgesOfBlock = 256, kVoxelsOfBlock = 1024;
constexpr std::uint64_t kLongest = std::uint64_t{1} << 20; // border, voxels
constexpr double kSameFace = 0.7; // least cosine between the normals of a point and of the face at its border
// In voxels:
constexpr double kLeastRadius = 0.05, kScallops = 0.05; // the latter squared
constexpr double kReach = 0.87;    // splats of points that are farther inside end before the border, or nearly
constexpr double kMaxHeight = 0.9; // of an edge over the tangent plane of its voxels
constexpr double kFarthest = 1.3;  // of a centre from an edge: sqrt(kReach^2 + kMaxHeight^2) and more
constexpr double kBeyond = 1;      // a voxel so far behind the border is none of the border's
constexpr double kAtBorder = 0.75; // a voxel off the plane that lies no farther inside meets the surface there
constexpr double kMinLean = 0.25;  // of the mean place of the voxels around, where they lie on one side
constexpr double kCovering = 0.8;  // radius that covers all of a voxel's surface, and a margin
constexpr int kAround = 2;         // the box of voxels around one reaches so far in each direction

// Calls `work(place)` for the places of a box, corners included, that lie in the grid.
template <class Work> void for_box(const glm::ivec3 &first, const glm::ivec3 &last, int grid_edge, const Work &work) {
    const glm::ivec3 from = glm::max(first, 0), to = glm::min(last, grid_edge - 1);
    for (int z = from.z; z <= to.z; ++z)
        for (int y = from.y; y <= to.y; ++y)
            for (int x = from.x; x <= to.x; ++x)
                work(glm::ivec3(x, y, z));
}

// An edge with one face. Lengths are in voxels.
struct BorderEdge {
    glm::dvec3 start, end;               // from the corner of the grid
    glm::dvec3 along;                    // from start to end
    double squared_length;               // above 0
    glm::dvec3 face;                     // unit normal
    glm::dvec3 outward;                  // unit, in the plane of the face
    std::array<glm::dvec3, 2> at_ends{}; // sums of `outward` of the edges that meet there

    std::uint64_t pieces() const { return static_cast<std::uint64_t>(std::sqrt(squared_length)) + 1; }
    // 0..1, limits included: the place of the nearest point along the edge.
    double nearest(const glm::dvec3 &place) const {
        return std::clamp(glm::dot(place - start, along) / squared_length, 0.0, 1.0);
    }
    // `t`: that of nearest().
    bool is_beyond(const glm::dvec3 &from_edge, double t) const {
        return glm::dot(from_edge, t > 0 && t < 1 ? outward : at_ends[t > 0 ? 1 : 0]) > 0;
    }
};

// Nothing for a face without an area.
std::optional<BorderEdge> border_edge(const Surface &surface, HalfEdge side, const Grid &grid) {
    const auto corner = [&](HalfEdge h) {
        const glm::dvec3 position = surface.positions[surface.triangles[h / 3][static_cast<int>(h % 3)]];
        return (position - vector_of(grid.origin)) / grid.voxel_size;
    };
    const glm::dvec3 start = corner(side), end = corner(next_side(side)), along = end - start;
    const glm::dvec3 across = glm::cross(along, corner(previous_side(side)) - start);
    const double twice_area = glm::length(across), squared_length = glm::dot(along, along);
    if (!(twice_area > 0) || !(squared_length > 0))
        return {};
    const glm::dvec3 face = across / twice_area, outward = glm::cross(along, face);
    return BorderEdge{start, end, along, squared_length, face, outward / glm::length(outward)};
}

// Fills BorderEdge::at_ends. Sums do not depend on the order of edges.
void join_ends(std::vector<BorderEdge> &edges) {
    struct End {
        glm::dvec3 at, outward;
        glm::dvec3 *sum;
        auto order() const { return std::tie(at.x, at.y, at.z, outward.x, outward.y, outward.z); }
    };
    std::vector<End> ends;
    for (BorderEdge &edge : edges) {
        ends.push_back({edge.start, edge.outward, &edge.at_ends[0]});
        ends.push_back({edge.end, edge.outward, &edge.at_ends[1]});
    }
    std::sort(ends.begin(), ends.end(), [](const End &a, const End &b) { return a.order() < b.order(); });
    for (std::size_t begin = 0, end = 0; begin < ends.size(); begin = end) {
        glm::dvec3 sum(0);
        for (; end < ends.size() && ends[end].at == ends[begin].at; ++end)
            sum += ends[end].outward;
        for (std::size_t i = begin; i < end; ++i)
            *ends[i].sum = sum;
    }
}

// A voxel near an edge.
struct AtBorder {
    std::uint32_t voxel;
    float distance; // in the tangent plane
    std::uint8_t radius;

    auto order() const { return std::tie(voxel, distance, radius); }
};

// Appends the voxels near an edge, each once. `near`: of `voxels`.
void find_at_border(const Voxels &voxels, const NearVoxels &near, const BorderEdge &edge, int grid_edge,
                    std::vector<AtBorder> &found) {
    const std::uint64_t pieces = edge.pieces();
    const auto count = static_cast<double>(pieces);
    for (std::uint64_t piece = 0; piece < pieces; ++piece) {
        const double from = static_cast<double>(piece) / count, to = static_cast<double>(piece + 1) / count;
        const glm::dvec3 a = edge.start + edge.along * from, b = edge.start + edge.along * to;
        const glm::ivec3 first(glm::floor(glm::min(a, b) - kFarthest)), last(glm::floor(glm::max(a, b) + kFarthest));
        for_box(first, last, grid_edge, [&](const glm::ivec3 &place) {
            const glm::dvec3 centre = glm::dvec3(place) + 0.5;
            const double t = edge.nearest(centre);
            const glm::dvec3 off = centre - (edge.start + edge.along * t);
            const bool is_of_piece = t >= from && (t < to || piece + 1 == pieces);
            if (!is_of_piece || glm::dot(off, off) > kFarthest * kFarthest)
                return;
            const MortonCode code = code_of(place);
            const std::size_t voxel = near.first_not_below(code);
            if (voxel == voxels.codes.size() || voxels.codes[voxel] != code ||
                voxels.points.normals[voxel] == kNoNormal)
                return;
            const TangentPlane plane(direction_of(voxels.points.normals[voxel]));
            if (std::fabs(plane.height(edge.face)) < kSameFace || std::fabs(plane.height(off)) > kMaxHeight)
                return;
            const double distance = glm::length(plane.flat(off));
            if (distance > kReach)
                return;
            const double radius = edge.is_beyond(off, t) ? kLeastRadius : std::sqrt(distance * distance + kScallops);
            found.push_back(
                {static_cast<std::uint32_t>(voxel), static_cast<float>(distance), radius_index(radius / grid_edge)});
        });
    }
}

// Whether a gap might open around a shrunk voxel with this radius (restore_where_gaps_open). `near`: of `voxels`.
bool gap_may_open(const Voxels &voxels, NearVoxelCursor &near, std::size_t voxel, double radius, int depth) {
    const TangentPlane plane(direction_of(voxels.points.normals[voxel]));
    // Centres of voxels of one plane lie at most so far from each other along its normal.
    const double thick = std::fabs(plane.normal.x) + std::fabs(plane.normal.y) + std::fabs(plane.normal.z);
    glm::dvec2 sum(0);
    double count = 1; // the voxel itself
    const auto around = near.within(voxel, 3 * kAround * kAround);
    const auto is_in_box = [](const Neighbour &other) {
        const glm::ivec3 steps = glm::abs(other.offset);
        return std::max({steps.x, steps.y, steps.z}) <= kAround;
    };
    for (const Neighbour &other : around)
        if (is_in_box(other) && std::fabs(plane.height(other.offset)) < thick) {
            sum += plane.flat(other.offset);
            ++count;
        }
    const double lean = glm::length(sum);
    if (lean <= kMinLean * count)
        return true; // the surface lies on all sides
    const glm::dvec2 outward = -sum / lean;
    const double border = std::sqrt(std::max(0.0, radius * radius - kScallops));
    bool is_covered = false;
    for (const Neighbour &other : around) {
        if (!is_in_box(other))
            continue;
        const glm::dvec2 at = plane.flat(other.offset);
        const double out = glm::dot(at, outward), beside = glm::length(at - out * outward);
        if (beside >= 1)
            continue;
        const bool is_of_plane = std::fabs(plane.height(other.offset)) < thick;
        if (out > (is_of_plane ? border + kBeyond : border - kAtBorder))
            return true;
        is_covered = is_covered || (is_of_plane && out < 0 &&
                                    radius_fraction(voxels.points.radii[other.voxel]) * (1 << depth) >= kCovering);
    }
    return !is_covered;
}

} // namespace

std::vector<HalfEdge> border_sides(const Surface &surface, int threads) {
    if (surface.triangles.size() > kMaxMeshFaces)
        return {};
    return join_edges(surface, threads).open;
}

void shrink_at_borders(const Surface &surface, std::span<const HalfEdge> sides, const Grid &grid, Voxels &voxels,
                       int threads) {
    std::vector<BorderEdge> edges;
    std::uint64_t length = 0;
    for (const HalfEdge side : sides)
        if (const auto edge = border_edge(surface, side, grid)) {
            edges.push_back(*edge);
            length += edge->pieces();
            if (length > kLongest)
                return;
        }
    if (edges.empty())
        return;
    join_ends(edges);
    const NearVoxels near(voxels.codes, grid.depth);
    std::vector<std::vector<AtBorder>> found((edges.size() + kEdgesOfBlock - 1) / kEdgesOfBlock);
    parallel_blocks(edges.size(), kEdgesOfBlock, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            find_at_border(voxels, near, edges[i], 1 << grid.depth, found[begin / kEdgesOfBlock]);
    });
    std::vector<AtBorder> all;
    for (std::vector<AtBorder> &some : found) {
        all.insert(all.end(), some.begin(), some.end());
        some = {};
    }
    std::sort(all.begin(), all.end(), [](const AtBorder &a, const AtBorder &b) { return a.order() < b.order(); });
    const std::uint8_t dense = dense_radius(grid.depth);
    for (std::size_t i = 0; i < all.size(); ++i) {
        std::uint8_t &radius = voxels.points.radii[all[i].voxel];
        if ((i == 0 || all[i].voxel != all[i - 1].voxel) && radius <= dense) // the nearest edge
            radius = std::min(all[i].radius, dense);
    }
}

bool ends_at_border(std::uint8_t radius, int depth) { return radius > 0 && radius < dense_radius(depth); }

void restore_where_gaps_open(Voxels &voxels, int depth, int threads) {
    struct Shrunk {
        std::size_t voxel;
        bool restored;
    };
    std::vector<Shrunk> shrunk;
    for (std::size_t i = 0; i < voxels.codes.size(); ++i)
        if (ends_at_border(voxels.points.radii[i], depth))
            shrunk.push_back({i, false});
    if (shrunk.empty())
        return;
    const NearVoxels near(voxels.codes, depth);
    parallel_blocks(shrunk.size(), kVoxelsOfBlock, threads, [&](std::size_t begin, std::size_t end) {
        NearVoxelCursor cursor(near);
        for (std::size_t i = begin; i < end; ++i) {
            const double radius = radius_fraction(voxels.points.radii[shrunk[i].voxel]) * (1 << depth);
            shrunk[i].restored = gap_may_open(voxels, cursor, shrunk[i].voxel, radius, depth);
        }
    });
    for (const Shrunk &one : shrunk)
        if (one.restored)
            voxels.points.radii[one.voxel] = dense_radius(depth);
}

} // namespace pbm::build
