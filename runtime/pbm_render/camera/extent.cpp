#include "pbm_render/camera/framing.h"

#include "pbm_format/model/point_values.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

constexpr std::size_t kMaxVoxels = std::size_t{1} << (3 * kBoundsLevel);

// Voxel edges. Points of dense scans reach no farther: their discs hardly stand out of the voxels of a level. Of few
// voxels, discs are a part of the model that one sees.
constexpr double kDenseReach = 0.95;
constexpr std::size_t kFewVoxels = 64;

struct Voxel {
    std::array<std::uint32_t, 3> place;
    double margin; // voxel edges by which discs may stand out
};

// `index`: radius of a point of `level`; of a coarser level than the finest, it covers the discs of all points below
// (BVG.md 6.2.3).
double margin_of(std::uint8_t index, int level, bool is_finest, double dense_reach) {
    const double reach = std::ldexp(radius_fraction(index), level);
    if (reach <= dense_reach)
        return 0;
    return reach - (is_finest ? 0.5 : std::sqrt(0.75));
}

// A mapped file may be rewritten since its masks were verified: from the first mask that makes no sense on, voxels
// stand for all below them.
std::vector<MortonCode> occupied(std::span<const ByteView> masks, int level) {
    std::vector<MortonCode> codes{0};
    for (int next = 1; next <= level; ++next) {
        auto below = expand_level(codes, masks[static_cast<std::size_t>(next)], kMaxVoxels);
        if (!below) {
            for (MortonCode &code : codes)
                code <<= 3 * (level - next + 1);
            return codes;
        }
        codes = std::move(*below);
    }
    return codes;
}

// Marks cell `start` and all that are connected with it as of cluster `number`. `cluster_of`: 0 for empty cells,
// kUnmarked for occupied ones without a cluster; [z][y][x].
constexpr std::uint32_t kUnmarked = ~0U;

void mark_cluster(std::size_t start, std::uint32_t number, int level, std::vector<std::uint32_t> &cluster_of) {
    const int edge = 1 << level;
    std::vector<std::size_t> open{start};
    cluster_of[start] = number;
    while (!open.empty()) {
        const auto cell = static_cast<int>(open.back());
        open.pop_back();
        const int x = cell % edge, y = cell / edge % edge, z = cell / edge / edge;
        for (int near_z = std::max(z - 1, 0); near_z <= std::min(z + 1, edge - 1); ++near_z)
            for (int near_y = std::max(y - 1, 0); near_y <= std::min(y + 1, edge - 1); ++near_y)
                for (int near_x = std::max(x - 1, 0); near_x <= std::min(x + 1, edge - 1); ++near_x) {
                    const int beside = (near_z * edge + near_y) * edge + near_x;
                    const auto near = static_cast<std::size_t>(beside);
                    if (cluster_of[near] == kUnmarked) {
                        cluster_of[near] = number;
                        open.push_back(near);
                    }
                }
    }
}

// Removes the voxels of specks.
void remove_specks(std::vector<Voxel> &all, int level) {
    const int cluster_level = std::min(level, kClusterLevel);
    const auto cell_of = [&](const Voxel &voxel) {
        const int finer = level - cluster_level;
        const auto [x, y, z] = voxel.place;
        return (((std::size_t{z >> finer} << cluster_level) + (y >> finer)) << cluster_level) + (x >> finer);
    };
    std::vector<std::uint32_t> cluster_of(std::size_t{1} << (3 * cluster_level), 0);
    for (const Voxel &voxel : all)
        cluster_of[cell_of(voxel)] = kUnmarked;
    std::uint32_t clusters = 0;
    for (std::size_t cell = 0; cell < cluster_of.size(); ++cell)
        if (cluster_of[cell] == kUnmarked)
            mark_cluster(cell, ++clusters, cluster_level, cluster_of);
    std::vector<std::size_t> voxels(clusters + 1);
    for (const Voxel &voxel : all)
        ++voxels[cluster_of[cell_of(voxel)]];
    const auto is_speck = [&, count = all.size()](std::uint32_t cluster) {
        return voxels[cluster] * kSpeckShare < count;
    };
    std::size_t in_specks = 0;
    for (std::uint32_t cluster = 1; cluster <= clusters; ++cluster)
        in_specks += is_speck(cluster) ? voxels[cluster] : 0;
    if (in_specks * kSpecksShare <= all.size())
        std::erase_if(all, [&](const Voxel &voxel) { return is_speck(cluster_of[cell_of(voxel)]); });
}

// The corners, in voxel edges, that may be of the convex hull: those of voxels that are outermost, towards the corner,
// of their rows along all three axes, moved outwards by their margins.
std::vector<glm::dvec3> outer_corners(const std::vector<Voxel> &voxels, int level) {
    struct Row {
        std::uint32_t first = ~0U, last = 0;
    };
    const auto edge = std::size_t{1} << level;
    std::array<std::vector<Row>, 3> rows; // [axis][place along the other two axes]
    rows.fill(std::vector<Row>(edge * edge));
    const auto row_of = [&](const std::array<std::uint32_t, 3> &place, std::size_t axis) -> Row & {
        return rows[axis][place[(axis + 1) % 3] * edge + place[(axis + 2) % 3]];
    };
    for (const Voxel &voxel : voxels)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Row &row = row_of(voxel.place, axis);
            row = {std::min(row.first, voxel.place[axis]), std::max(row.last, voxel.place[axis])};
        }
    std::vector<glm::dvec3> corners;
    for (const auto &[place, margin] : voxels) {
        unsigned first = 0, last = 0; // a bit per axis
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const Row &row = row_of(place, axis);
            first |= unsigned{place[axis] == row.first} << axis;
            last |= unsigned{place[axis] == row.last} << axis;
        }
        if ((first | last) != 7)
            continue;
        // Both ends of a row of one voxel: all combinations of those axes.
        const unsigned both = first & last;
        for (unsigned some = 0;; some = (some - both) & both) {
            const unsigned corner = (last & ~first) | some;
            const glm::dvec3 outwards(corner & 1, corner >> 1 & 1, corner >> 2);
            corners.push_back(glm::dvec3(place[0], place[1], place[2]) + outwards + margin * (2.0 * outwards - 1.0));
            if (some == both)
                break;
        }
    }
    return corners;
}

// The corner that is farthest from a point.
glm::dvec3 farthest_corner(const std::vector<glm::dvec3> &corners, glm::dvec3 from) {
    const auto squared_distance = [&](glm::dvec3 p) { return glm::dot(p - from, p - from); };
    return *std::max_element(corners.begin(), corners.end(), [&](const glm::dvec3 &a, const glm::dvec3 &b) {
        return squared_distance(a) < squared_distance(b);
    });
}

// Centre of the smallest sphere around a few points: moves towards the farthest point in shrinking steps.
glm::dvec3 middle_of(const std::vector<glm::dvec3> &points, glm::dvec3 start) {
    glm::dvec3 centre = start;
    double step = 0.5;
    for (int i = 0; i < 150; ++i, step *= 0.94)
        centre += step * (farthest_corner(points, centre) - centre);
    return centre;
}

// An approximation of the smallest sphere around corners: the sphere around a few of them, to which the farthest corner
// is added until it lies inside.
// Based on: Badoiu, Clarkson. Smaller core-sets for balls. 2003
Sphere enclose(const std::vector<glm::dvec3> &corners) {
    constexpr int kMaxSteps = 32;
    constexpr double kWider = 1.001;
    glm::dvec3 low = corners.front(), high = low;
    for (const glm::dvec3 &corner : corners) {
        low = glm::min(low, corner);
        high = glm::max(high, corner);
    }
    Sphere best{.centre = {}, .radius = std::numeric_limits<double>::infinity()};
    std::vector<glm::dvec3> support;
    glm::dvec3 centre = (low + high) / 2.0;
    for (int i = 0; i < kMaxSteps; ++i) {
        const glm::dvec3 corner = farthest_corner(corners, centre);
        const double reach = glm::length(corner - centre);
        if (reach < best.radius)
            best = {.centre = centre, .radius = reach};
        double inner = 0; // lower bound of the radius of any sphere around the support
        for (const glm::dvec3 &point : support)
            inner = std::max(inner, glm::length(point - centre));
        if (best.radius <= kWider * inner)
            break;
        support.push_back(corner);
        centre = middle_of(support, centre);
    }
    return best;
}

} // namespace

Extent find_extent(const Grid &grid, const CoarseVoxels &coarse) {
    const auto [masks, level, radii, hidden] = coarse;
    assert(level >= 0 && level <= kBoundsLevel);
    const std::vector<MortonCode> codes = occupied(masks, level);
    const bool is_finest = level == grid.depth;
    const double dense_reach = is_finest && codes.size() < kFewVoxels ? 0.5 : kDenseReach;
    std::vector<Voxel> voxels;
    voxels.reserve(codes.size());
    const bool draws_some = std::find(hidden.begin(), hidden.end(), 0) != hidden.end();
    for (std::size_t i = 0; i < codes.size(); ++i)
        if (!draws_some || i >= hidden.size() || hidden[i] == 0)
            voxels.push_back(
                {morton_decode(codes[i]), i < radii.size() ? margin_of(radii[i], level, is_finest, dense_reach) : 0});
    remove_specks(voxels, level);
    Extent extent{.sphere = {}, .corners = outer_corners(voxels, level)};
    extent.sphere = enclose(extent.corners);
    const double edge = grid.voxel_size_at(level);
    const auto to_model = [&](const glm::dvec3 &p) {
        return glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) + edge * p;
    };
    for (glm::dvec3 &corner : extent.corners)
        corner = to_model(corner);
    extent.sphere = {to_model(extent.sphere.centre), edge * extent.sphere.radius};
    return extent;
}

Extent find_extent(const Grid &grid, std::span<const Level> levels) {
    levels = levels.first(std::min(levels.size(), std::size_t{kBoundsLevel} + 1));
    std::vector<ByteView> masks;
    for (const Level &level : levels)
        masks.emplace_back(level.masks);
    return find_extent(grid, {masks, static_cast<int>(levels.size()) - 1, levels.back().points.radii, {}});
}

} // namespace pbm
