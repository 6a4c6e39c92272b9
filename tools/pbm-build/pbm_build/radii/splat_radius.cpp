#include "pbm_build/radii/splat_radius.h"

#include "pbm_build/lattice/lattice.h"
#include "pbm_build/neighbours/near_voxels.h"
#include "pbm_build/neighbours/outliers.h"
#include "pbm_build/radii/tangent_cell.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr int kMaxShared = 7;               // steps of the radius table: a factor of 1.5
constexpr std::size_t kRing = 8;            // spacing: the distance of this neighbour
constexpr double kFlatGap = 2;              // maximum reach over the spacing around, where the surface is flat
constexpr double kStray = 3;                // maximum reach over the median spacing of all
constexpr std::size_t kNormalVotes = 16;    // neighbours whose normals are averaged
constexpr double kMaxVoxels = 2;            // maximum radius of dense samples, voxels
constexpr std::size_t kCellNeighbours = 12; // neighbours that clip a cell
constexpr std::size_t kMoreNeighbours = NearVoxelCursor::kMax; // where these do not close it
constexpr double kFlatCosine = 0.9, kFlatSlope = 0.2; // limits of a flat surface between a point and a neighbour
constexpr std::size_t kBorder = 5;                    // minimum reach at a border: the distance of this neighbour
constexpr float kFarthestGiven = 1024; // squared distance of a made point from a given one; no gap is as wide
constexpr std::size_t kSecond = 2;     // neighbour whose distance is the spacing of points beside round ones
constexpr float kRoundReach = 0.5F;    // radius of round points over that distance
constexpr int kRoundStep = 3;          // of its radius index
constexpr double kOverlap = 1.1;       // overlap of splats, since neighbours lie slightly off the tangent plane

float distance_of(std::span<const Neighbour> near, std::size_t neighbour) {
    return near.empty() ? 0 : std::sqrt(near[std::min(neighbour, near.size()) - 1].squared_distance);
}

// Indices of the values equal to `missing`.
template <class T> std::vector<std::size_t> indices_of(const std::vector<T> &values, T missing) {
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i < values.size(); ++i)
        if (values[i] == missing)
            indices.push_back(i);
    return indices;
}

// Distances in voxels of the farthest corners of the Voronoi cell of a voxel's centre in its tangent plane.
struct CellReach {
    double closed = 0;   // of corners between two neighbours
    double flat = 0;     // of those that no further neighbour would clip, and whose two neighbours lie with the voxel
                         // on a flat surface
    bool open = true;    // no neighbour lies in some direction
    bool at_gap = false; // further neighbours may lie beyond a gap of a flat surface
};

// The cell is clipped by the neighbours of the same sheet.
CellReach reach_of_cell(const Voxels &voxels, std::size_t voxel, std::span<const Neighbour> near) {
    if (near.empty())
        return {};
    const std::vector<std::uint16_t> &normals = voxels.points.normals;
    const TangentPlane plane(direction_of(normals[voxel]));
    const auto seen = static_cast<double>(distance_of(near, near.size()));
    TangentCell cell(seen);
    constexpr int kFlat = 1, kBent = 2; // labels of neighbours: bits
    std::size_t flat_count = 0;
    for (const Neighbour &neighbour : near) {
        const glm::dvec3 offset(neighbour.offset), m = direction_of(normals[neighbour.voxel]);
        const bool either = ((normals[voxel] | normals[neighbour.voxel]) & kTwoSidedBit) != 0;
        const double cosine = either ? std::fabs(plane.height(m)) : plane.height(m), height = plane.height(offset);
        const glm::dvec2 flat = plane.flat(offset);
        const double squared = glm::dot(flat, flat);
        const bool is_flat = cosine > kFlatCosine && height * height < kFlatSlope * kFlatSlope * squared;
        flat_count += is_flat ? 1 : 0;
        if (squared > 0.25 && is_same_sheet(cosine, height, squared))
            cell.cut(flat, is_flat ? kFlat : kBent);
    }
    const TangentCell::Reach reach = cell.reach();
    const auto ring = static_cast<double>(distance_of(near, kRing));
    const double known = seen * seen / 4, gap = std::max(known, ring * ring / (kOverlap * kOverlap)); // squared
    double flat_reach = 0;
    CellReach result{kOverlap * reach.closed, 0, reach.open, false};
    const auto corners = cell.corners();
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const double squared = glm::dot(corners[i].at, corners[i].at);
        const int edge = corners[i].next_edge, before = corners[i > 0 ? i - 1 : corners.size() - 1].next_edge;
        result.at_gap = result.at_gap || (squared > gap && ((edge | before) & kBent) == 0);
        if ((edge & before) == kFlat && squared <= known) // no further neighbour is nearer to it
            flat_reach = std::max(flat_reach, squared);
    }
    result.flat = kOverlap * std::sqrt(flat_reach);
    result.at_gap = result.at_gap && 2 * flat_count >= near.size();
    return result;
}

// The nearest voxels; the voxel itself where there are fewer.
using VoxelsAround = std::array<std::uint32_t, kCellNeighbours>;
VoxelsAround indices_around(std::size_t voxel, std::span<const Neighbour> near) {
    VoxelsAround around;
    around.fill(static_cast<std::uint32_t>(voxel));
    for (std::size_t k = 0; k < near.size(); ++k)
        around[k] = near[k].voxel;
    return around;
}

// The reach of one voxel before it is limited by the spacing around.
struct Reach {
    float closed = 0, flat = 0, border = 0; // border: minimum
    bool open = false;
    float round = 0;        // maximum of a round point, else 0
    float beside_round = 0; // maximum of a point of a surface beside round points, else 0
    VoxelsAround around{};
};

bool is_round_point(const Voxels &voxels, std::span<const Material> materials, std::size_t voxel) {
    const Bytes &ids = voxels.points.materials;
    return !ids.empty() && is_round(materials[ids[voxel]]);
}

// A disc beside leaves ends where a neighbour lies a spacing off its plane, for it would hide what is behind that. 0
// where no round point is near.
float reach_beside_round(const Voxels &voxels, std::span<const Material> materials, std::size_t voxel,
                         std::span<const Neighbour> near) {
    if (std::none_of(near.begin(), near.end(),
                     [&](const Neighbour &neighbour) { return is_round_point(voxels, materials, neighbour.voxel); }))
        return 0;
    const UnitVector &n = normal_table()[voxels.points.normals[voxel] & kNormalIndexMask];
    const glm::dvec3 normal(n[0], n[1], n[2]);
    const auto spacing = static_cast<double>(distance_of(near, kSecond));
    double squared_reach = near.back().squared_distance;
    for (const Neighbour &neighbour : near) {
        const double height = glm::dot(glm::dvec3(neighbour.offset), normal);
        if (height * height > spacing * spacing)
            squared_reach = std::min(squared_reach, neighbour.squared_distance - height * height);
    }
    return static_cast<float>(std::max(spacing, std::sqrt(std::max(squared_reach, 0.0))));
}

Reach reach_of(const Voxels &voxels, std::span<const Material> materials, std::size_t voxel, NearVoxelCursor &cursor,
               float &ring) {
    std::array<Neighbour, kMoreNeighbours> found;
    auto near = std::span(found).first(cursor.nearest(voxel, std::span(found).first(kCellNeighbours)));
    const CellReach cell = reach_of_cell(voxels, voxel, near);
    Reach reach{static_cast<float>(cell.closed), static_cast<float>(cell.flat),
                cell.open ? distance_of(near, kBorder) : 0, cell.open, 0};
    ring = distance_of(near, kRing);
    reach.around = indices_around(voxel, near);
    reach.beside_round = reach_beside_round(voxels, materials, voxel, near);
    const bool beside_made = cell.open && !voxels.made.empty(); // the nearest may all be made ones
    if (cell.at_gap || beside_made) {
        near = std::span(found).first(cursor.nearest(voxel, found));
        const CellReach wider = reach_of_cell(voxels, voxel, near);
        reach.flat = wider.open ? 0 : static_cast<float>(wider.flat); // a large splat would extend beyond the border
        if (beside_made) {
            reach.closed = static_cast<float>(wider.closed);
            reach.open = wider.open;
        }
    }
    return reach;
}

Reach reach_of_round(std::size_t voxel, NearVoxelCursor &cursor, float &ring) {
    std::array<Neighbour, kCellNeighbours> found;
    const auto near = std::span(found).first(cursor.nearest(voxel, found));
    ring = distance_of(near, kRing);
    Reach reach;
    reach.round = kRoundReach * distance_of(near, kSecond);
    reach.around = indices_around(voxel, near);
    return reach;
}

// The median of the known spacings of a voxel and those around it.
float spacing_around(const std::vector<float> &rings, float own, const VoxelsAround &around) {
    std::array<float, kCellNeighbours + 1> some{own};
    std::size_t count = 1;
    for (const std::uint32_t voxel : around)
        if (rings[voxel] > 0)
            some[count++] = rings[voxel];
    const auto middle = some.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(some.begin(), middle, some.begin() + static_cast<std::ptrdiff_t>(count));
    return *middle;
}

// Spacings of a scan before up-sampling, in voxels: what a splat may reach where a gap was not filled.
struct GivenSpacing {
    std::vector<float> around, border; // [voxels] the spacing around; the distance of neighbour kBorder
    float median = 0;                  // spacing

    // The values of the nearest given voxel for those that up-sampling filled.
    GivenSpacing(const Voxels &voxels, int depth, int threads)
        : around(voxels.codes.size()), border(voxels.codes.size()) {
        std::vector<MortonCode> codes; // of given voxels
        std::set_difference(voxels.codes.begin(), voxels.codes.end(), voxels.made.begin(), voxels.made.end(),
                            std::back_inserter(codes));
        const NearVoxels near_voxels(codes, depth);
        std::vector<float> rings(codes.size()), borders(codes.size());
        std::vector<VoxelsAround> neighbours(codes.size());
        parallel_blocks(codes.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
            NearVoxelCursor cursor(near_voxels);
            std::array<Neighbour, kCellNeighbours> found;
            for (std::size_t i = begin; i < end; ++i) {
                const auto near = std::span(found).first(cursor.nearest(i, found));
                rings[i] = distance_of(near, kRing);
                borders[i] = distance_of(near, kBorder);
                neighbours[i] = indices_around(i, near);
            }
        });
        const PointNeighbours tree(centres_of(codes));
        parallel_blocks(voxels.codes.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
            NeighbourCursor cursor(tree);
            for (std::size_t i = begin; i < end; ++i) {
                std::size_t given = static_cast<std::size_t>(
                    std::lower_bound(codes.begin(), codes.end(), voxels.codes[i]) - codes.begin());
                if (given == codes.size() || codes[given] != voxels.codes[i]) {
                    std::array<NearPoint, 1> nearest;
                    const auto at = morton_decode(voxels.codes[i]);
                    if (cursor.nearest_within({at[0], at[1], at[2]}, kFarthestGiven, nearest) == 0)
                        continue;
                    given = nearest[0].point;
                }
                around[i] = spacing_around(rings, rings[given], neighbours[given]);
                border[i] = borders[given];
            }
        });
        median = median_of(std::move(rings));
    }
};

// Returns classes[radius_index(fraction)] by linear search: most radii are in the first few classes.
class ClassFinder {
  public:
    explicit ClassFinder(const RadiusClasses &classes) {
        for (std::size_t index = 0; index < classes.size(); ++index)
            if (classes_.empty() || classes[index] != classes_.back()) {
                classes_.push_back(classes[index]);
                most_.push_back(radius_fraction(classes[index]));
            }
    }
    std::uint8_t operator()(double fraction) const {
        std::size_t at = 0;
        while (at + 1 < most_.size() && !(fraction <= most_[at]))
            ++at;
        return classes_[at];
    }

  private:
    Bytes classes_;
    std::vector<double> most_; // that each covers, of the grid's edge
};

// Gives the voxels of `some` below one node the largest of their radii, unless it is more than kMaxShared steps above
// theirs.
void share_below_nodes(const Voxels &voxels, std::span<const std::size_t> some, Bytes &radii) {
    for (std::size_t begin = 0, end = 0; begin < some.size(); begin = end) {
        const MortonCode node = voxels.codes[some[begin]] >> 3;
        std::uint8_t largest = 0;
        for (; end < some.size() && voxels.codes[some[end]] >> 3 == node; ++end)
            largest = std::max(largest, radii[some[end]]);
        for (std::size_t i = begin; i < end; ++i)
            if (largest - radii[some[i]] <= kMaxShared)
                radii[some[i]] = largest;
    }
}

// Whether a position is the middle of a voxel: a point of a model of this grid.
bool is_in_middle(const glm::dvec3 &position, const Grid &grid) {
    constexpr double kNear = 1e-3; // voxels
    const glm::dvec3 at = (position - vector_of(grid.origin)) / grid.voxel_size;
    const glm::dvec3 off = glm::abs(glm::fract(at) - 0.5);
    return std::max({off.x, off.y, off.z}) < kNear;
}

} // namespace

std::uint8_t dense_radius(int depth) {
    return static_cast<std::uint8_t>(std::min<int>(kMaxFinestRadius, 255 - 12 * depth - 2));
}

RadiusClasses radius_classes(int depth) {
    // The radius two levels above children with this radius.
    const auto above = [&](int radius) {
        return covering_radius(covering_radius(static_cast<std::uint8_t>(radius), depth - 1), depth - 2);
    };
    RadiusClasses classes{};
    std::size_t index = 0;
    for (int radius = dense_radius(depth);;) {
        for (; static_cast<int>(index) <= radius; ++index)
            classes[index] = static_cast<std::uint8_t>(radius);
        if (radius == kMaxFinestRadius)
            break;
        do
            ++radius;
        while (radius < kMaxFinestRadius && above(radius + 1) == above(radius));
    }
    std::fill(classes.begin() + static_cast<std::ptrdiff_t>(index), classes.end(), kMaxFinestRadius);
    return classes;
}

Bytes given_radii(const Surface &surface, const Grid &grid) {
    const std::size_t first_point = surface.first_point();
    const bool mixed = first_point > 0 && first_point < surface.positions.size();
    if (surface.radii.empty() && !mixed)
        return {};
    const RadiusClasses classes = radius_classes(grid.depth);
    const std::uint8_t dense = dense_radius(grid.depth);
    Bytes radii;
    radii.reserve(surface.positions.size());
    const double max_of_triangle = kMaxVoxels / static_cast<double>(std::uint64_t{1} << grid.depth);
    for (std::size_t i = 0; i < surface.positions.size(); ++i) {
        const double given = surface.radii.empty() ? 0 : static_cast<double>(surface.radii[i]);
        const bool point = i >= first_point;
        const std::uint8_t index = radius_index(std::min(given / grid.edge(), point ? 1 : max_of_triangle));
        if (point && !(given > 0))
            radii.push_back(0);
        else
            radii.push_back(point && index < dense && is_in_middle(surface.positions[i], grid) ? index
                                                                                               : classes[index]);
    }
    return radii;
}

void radii_from_neighbours(Voxels &voxels, std::span<const Material> materials, int depth, int threads) {
    std::vector<std::size_t> missing = indices_of(voxels.points.radii, std::uint8_t{0});
    if (missing.empty())
        return;
    const std::size_t count = missing.size();
    const double edge = static_cast<double>(std::uint64_t{1} << depth); // in voxels
    const NearVoxels near_voxels(voxels.codes, depth);
    std::vector<Reach> reaches(count);
    std::vector<float> rings(voxels.codes.size(), 0); // in voxels; 0: not known
    parallel_blocks(count, kBlock, threads, [&](std::size_t begin, std::size_t end) {
        NearVoxelCursor cursor(near_voxels);
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t voxel = missing[i];
            reaches[i] = is_round_point(voxels, materials, voxel)
                             ? reach_of_round(voxel, cursor, rings[voxel])
                             : reach_of(voxels, materials, voxel, cursor, rings[voxel]);
        }
    });
    std::optional<GivenSpacing> given;
    if (!voxels.made.empty())
        given.emplace(voxels, depth, threads);
    std::vector<float> known;
    known.reserve(count);
    for (const std::size_t voxel : missing)
        known.push_back(rings[voxel]);
    const auto median = static_cast<double>(given ? given->median : median_of(std::move(known)));
    const ClassFinder class_of(radius_classes(depth));
    parallel_for(count, kBlock, threads, [&](std::size_t i) {
        const Reach &reach = reaches[i];
        const float ring = rings[missing[i]];
        float spacing = spacing_around(rings, ring, reach.around), border = reach.border;
        if (given) {
            spacing = std::max(spacing, given->around[missing[i]]);
            border = reach.open ? std::max(border, given->border[missing[i]]) : 0;
        }
        auto wanted = std::max(
            {std::min(reach.closed, spacing), border, std::min(reach.flat, static_cast<float>(kFlatGap) * spacing)});
        if (reach.beside_round > 0)
            wanted = std::min(wanted, reach.beside_round);
        const double most = ring > kOutlierFactor * median ? median : kStray * median;
        if (reach.round > 0) {
            const int index = radius_index(std::min(static_cast<double>(reach.round), most) / edge);
            voxels.points.radii[missing[i]] =
                static_cast<std::uint8_t>(std::min<int>(index / kRoundStep * kRoundStep, kMaxFinestRadius));
            return;
        }
        voxels.points.radii[missing[i]] = class_of(std::min(static_cast<double>(wanted), most) / edge);
    });
    std::erase_if(missing, [&](std::size_t voxel) { return is_round_point(voxels, materials, voxel); });
    share_below_nodes(voxels, missing, voxels.points.radii);
}

void fill_normals(Voxels &voxels, int threads) {
    std::vector<std::uint16_t> &normals = voxels.points.normals;
    const std::vector<std::size_t> missing = indices_of(normals, kNoNormal);
    if (missing.empty())
        return;
    const PointNeighbours neighbours(centres_of(voxels.codes));
    const auto table = integer_normal_table();
    std::vector<std::uint16_t> filled(missing.size());
    parallel_for(missing.size(), threads, [&](std::size_t m) {
        std::array<NearPoint, kNormalVotes> found;
        const std::size_t near = NeighbourCursor(neighbours).nearest(missing[m], found);
        std::array<std::int64_t, 3> sum{};
        for (std::size_t k = 0; k < near; ++k)
            if (const std::uint16_t normal = normals[found[k].point]; normal != kNoNormal)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    sum[axis] += table[normal & kNormalIndexMask][axis];
        filled[m] = sum == std::array<std::int64_t, 3>{}
                        ? static_cast<std::uint16_t>(quantise_normal(0, 0, 1) | kTwoSidedBit)
                        : quantise_normal(static_cast<double>(sum[0]), static_cast<double>(sum[1]),
                                          static_cast<double>(sum[2]));
    });
    for (std::size_t m = 0; m < missing.size(); ++m)
        normals[missing[m]] = filled[m];
}

} // namespace pbm::build
