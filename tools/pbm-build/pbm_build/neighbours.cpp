#include "pbm_build/neighbours.h"

#include <algorithm>
#include <array>
#include <cassert>

#include <nanoflann.hpp>

namespace pbm::build {
namespace {

// Voxel indices as floats: exact, like the squares of distances up to thousands of voxels.
struct Cloud {
    std::vector<std::array<float, 3>> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][axis]; }
    template <class Box> bool kdtree_get_bbox(Box &) const { return false; }
};

Cloud cloud_of(std::span<const MortonCode> codes) {
    Cloud cloud;
    cloud.points.reserve(codes.size());
    for (const MortonCode code : codes) {
        const auto v = morton_decode(code);
        cloud.points.push_back({static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
    }
    return cloud;
}

// Stored as integers, compared as doubles: exact for near points, whatever the extent of the cloud.
struct LatticeCloud {
    std::vector<LatticePoint> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][static_cast<int>(axis)]; }
    template <class Box> bool kdtree_get_bbox(Box &) const { return false; }
};

} // namespace

struct VoxelNeighbours::Tree {
    using Distance = nanoflann::L2_Simple_Adaptor<float, Cloud, float, std::uint32_t>;
    using Index = nanoflann::KDTreeSingleIndexAdaptor<Distance, Cloud, 3, std::uint32_t>;

    Cloud cloud;
    Index index;

    explicit Tree(Cloud points)
        : cloud(std::move(points)), index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {
        index.buildIndex();
    }
};

VoxelNeighbours::VoxelNeighbours(std::span<const MortonCode> codes) : tree_(std::make_unique<Tree>(cloud_of(codes))) {}
VoxelNeighbours::~VoxelNeighbours() = default;

std::size_t VoxelNeighbours::nearest(std::size_t voxel, std::span<Neighbour> found) const {
    assert(found.size() <= kMost);
    std::array<std::uint32_t, kMost + 1> indices;
    std::array<float, kMost + 1> distances;
    const std::size_t count =
        tree_->index.knnSearch(tree_->cloud.points[voxel].data(), found.size() + 1, indices.data(), distances.data());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count && kept < found.size(); ++i)
        if (indices[i] != voxel)
            found[kept++] = {indices[i], distances[i]};
    std::sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept),
              [](const Neighbour &a, const Neighbour &b) {
                  return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                                  : a.voxel < b.voxel;
              });
    return kept;
}

struct PointNeighbours::Tree {
    using Distance = nanoflann::L2_Simple_Adaptor<double, LatticeCloud, double, std::uint32_t>;
    using Index = nanoflann::KDTreeSingleIndexAdaptor<Distance, LatticeCloud, 3, std::uint32_t>;

    LatticeCloud cloud;
    Index index;

    explicit Tree(std::vector<LatticePoint> points)
        : cloud{std::move(points)}, index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {
        index.buildIndex();
    }
};

PointNeighbours::PointNeighbours(std::vector<LatticePoint> points) : tree_(std::make_unique<Tree>(std::move(points))) {}
PointNeighbours::~PointNeighbours() = default;

const std::vector<LatticePoint> &PointNeighbours::points() const { return tree_->cloud.points; }

std::size_t PointNeighbours::nearest(std::size_t point, std::span<NearPoint> found) const {
    assert(found.size() <= kMost);
    std::array<std::uint32_t, kMost + 1> indices;
    std::array<double, kMost + 1> distances;
    const LatticePoint &p = points()[point];
    const std::array<double, 3> query{static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
    const std::size_t count = tree_->index.knnSearch(query.data(), found.size() + 1, indices.data(), distances.data());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count && kept < found.size(); ++i)
        if (indices[i] != point)
            found[kept++] = {indices[i], distances[i]};
    std::sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept),
              [](const NearPoint &a, const NearPoint &b) {
                  return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                                  : a.point < b.point;
              });
    return kept;
}

} // namespace pbm::build
