#include "pbm_build/neighbours/near_voxels.h"

#include <algorithm>
#include <cassert>

namespace pbm::build {
namespace {

constexpr int kNodeBits = 3; // nodes of 8x8x8 voxels
constexpr int kNodeEdge = 1 << kNodeBits;
constexpr int kReach = 4; // the grid extends so many voxels beyond its node
constexpr int kGridEdge = kNodeEdge + 2 * kReach;
constexpr int kTableLevel = 6;

constexpr int place_in_grid(int x, int y, int z) { return (z * kGridEdge + y) * kGridEdge + x; }

// [last bits of a code] the voxel's place in the grid, relative to the node's corner.
constexpr auto kPlaces = [] {
    std::array<std::int16_t, std::size_t{1} << 3 * kNodeBits> places{};
    for (std::size_t code = 0; code < places.size(); ++code) {
        const auto v = morton_decode(code);
        places[code] = static_cast<std::int16_t>(
            place_in_grid(static_cast<int>(v[0]), static_cast<int>(v[1]), static_cast<int>(v[2])));
    }
    return places;
}();

// Offsets to all voxels within kReach, sorted by distance.
struct Shells {
    struct Offset {
        std::int8_t x, y, z;
        std::uint8_t squared;
    };
    static constexpr std::size_t kOffsets = 256; // lattice points within 4, without the origin
    std::array<Offset, kOffsets> offsets;
    std::array<std::int16_t, kOffsets> places;                // the same in a grid
    std::array<std::uint16_t, kReach * kReach + 1> ends_with; // [squared distance] offsets up to there

    Neighbour neighbour(std::uint32_t voxel, std::uint32_t offset) const {
        const Offset &o = offsets[offset];
        return {voxel, static_cast<float>(o.squared), {o.x, o.y, o.z}};
    }
};

constexpr Shells kShells = [] {
    Shells shells{};
    std::size_t count = 0;
    for (int squared = 1; squared <= kReach * kReach; ++squared) {
        for (int z = -kReach; z <= kReach; ++z)
            for (int y = -kReach; y <= kReach; ++y)
                for (int x = -kReach; x <= kReach; ++x)
                    if (x * x + y * y + z * z == squared) {
                        shells.offsets[count] = {static_cast<std::int8_t>(x), static_cast<std::int8_t>(y),
                                                 static_cast<std::int8_t>(z), static_cast<std::uint8_t>(squared)};
                        shells.places[count++] = static_cast<std::int16_t>(place_in_grid(x, y, z));
                    }
        shells.ends_with[static_cast<std::size_t>(squared)] = static_cast<std::uint16_t>(count);
    }
    return shells;
}();
static_assert(kShells.ends_with.back() == Shells::kOffsets);

} // namespace

NearVoxels::NearVoxels(std::span<const MortonCode> codes, int depth)
    : codes_(codes), depth_(depth), shift_(3 * std::max(0, depth - kTableLevel)),
      starts_((std::size_t{1} << (3 * depth - shift_)) + 1, 0) {
    for (const MortonCode code : codes)
        ++starts_[(code >> shift_) + 1];
    for (std::size_t i = 1; i < starts_.size(); ++i)
        starts_[i] += starts_[i - 1];
}

std::size_t NearVoxels::first_not_below(MortonCode code) const {
    const std::size_t node = code >> shift_;
    if (node + 1 >= starts_.size())
        return codes_.size();
    const auto begin = codes_.begin() + starts_[node], end = codes_.begin() + starts_[node + 1];
    return static_cast<std::size_t>(std::lower_bound(begin, end, code) - codes_.begin());
}

const PointNeighbours &NearVoxels::tree() const {
    std::call_once(tree_made_, [&] { tree_ = std::make_unique<PointNeighbours>(centres_of(codes_)); });
    return *tree_;
}

NearVoxelCursor::NearVoxelCursor(const NearVoxels &voxels)
    : voxels_(voxels), grid_(static_cast<std::size_t>(kGridEdge * kGridEdge * kGridEdge)) {}

void NearVoxelCursor::gather(MortonCode node) {
    node_ = node;
    for (const std::size_t place : filled_)
        grid_[place] = 0;
    filled_.clear();
    const auto centre = morton_decode(node);
    const int nodes = 1 << std::max(0, voxels_.depth_ - kNodeBits);
    const std::span<const MortonCode> codes = voxels_.codes_;
    for (int n = 0; n < 27; ++n) {
        const std::array<int, 3> step{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        std::array<std::uint32_t, 3> at{};
        MortonCode halves = 0, near_half = 0; // bits for the half of its node, per axis; their value within reach
        bool inside = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const int c = static_cast<int>(centre[axis]) + step[axis];
            inside = inside && c >= 0 && c < nodes;
            at[axis] = static_cast<std::uint32_t>(c);
            const MortonCode half = MortonCode{1} << (3 * (kNodeBits - 1) + axis);
            halves |= step[axis] != 0 ? half : 0;
            near_half |= step[axis] < 0 ? half : 0;
        }
        if (!inside)
            continue;
        const MortonCode other = morton_encode(at[0], at[1], at[2]);
        const int corner =
            place_in_grid(kReach + kNodeEdge * step[0], kReach + kNodeEdge * step[1], kReach + kNodeEdge * step[2]);
        for (std::size_t i = voxels_.first_not_below(other << 3 * kNodeBits);
             i < codes.size() && codes[i] >> 3 * kNodeBits == other; ++i) {
            if ((codes[i] & halves) != near_half)
                continue;
            const int sum = corner + kPlaces[codes[i] & (kPlaces.size() - 1)];
            const auto place = static_cast<std::size_t>(sum);
            grid_[place] = static_cast<std::uint32_t>(i) + 1;
            filled_.push_back(place);
        }
    }
}

std::size_t NearVoxelCursor::nearest_by_tree(std::size_t voxel, std::span<Neighbour> found) {
    const PointNeighbours &tree = voxels_.tree();
    if (!in_tree_)
        in_tree_.emplace(tree);
    std::array<NearPoint, kMax> near;
    const std::size_t count = in_tree_->nearest(voxel, std::span(near).first(found.size()));
    for (std::size_t i = 0; i < count; ++i)
        found[i] = {near[i].point, static_cast<float>(near[i].squared_distance),
                    tree.points()[near[i].point] - tree.points()[voxel]};
    return count;
}

const std::uint32_t *NearVoxelCursor::grid_around(std::size_t voxel) {
    const MortonCode code = voxels_.codes_[voxel];
    if (code >> 3 * kNodeBits != node_)
        gather(code >> 3 * kNodeBits);
    return grid_.data() + place_in_grid(kReach, kReach, kReach) + kPlaces[code & (kPlaces.size() - 1)];
}

std::size_t NearVoxelCursor::nearest(std::size_t voxel, std::span<Neighbour> found) {
    assert(found.size() <= kMax);
    const std::uint32_t *const centre = grid_around(voxel);
    struct Near {
        std::uint32_t voxel; // index + 1
        std::uint32_t offset;
    };
    std::array<Near, Shells::kOffsets> near;
    std::size_t count = 0;
    std::uint32_t offset = 0;
    for (std::size_t squared = 1; squared < kShells.ends_with.size() && count < found.size(); ++squared)
        for (; offset < kShells.ends_with[squared]; ++offset) {
            const std::uint32_t other = centre[kShells.places[offset]];
            near[count] = {other, offset};
            count += other != 0 ? 1 : 0;
        }
    if (count < found.size())
        return nearest_by_tree(voxel, found);
    for (std::size_t i = 0; i < found.size(); ++i)
        found[i] = kShells.neighbour(near[i].voxel - 1, near[i].offset);
    return found.size();
}

std::span<const Neighbour> NearVoxelCursor::within(std::size_t voxel, int squared) {
    assert(squared <= kReach * kReach);
    const std::uint32_t *const centre = grid_around(voxel);
    within_.clear();
    for (std::uint32_t offset = 0; offset < kShells.ends_with[static_cast<std::size_t>(squared)]; ++offset)
        if (const std::uint32_t other = centre[kShells.places[offset]]; other != 0)
            within_.push_back(kShells.neighbour(other - 1, offset));
    return within_;
}

} // namespace pbm::build
