#include "pbm_build/near_voxels.h"

#include <algorithm>
#include <cassert>

namespace pbm::build {
namespace {

constexpr int kCellBits = 2;           // cells of 4x4x4 voxels
constexpr int kReach = 1 << kCellBits; // all voxels so near lie in the cell itself or the 26 around it
constexpr int kTableLevel = 6;

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

const VoxelNeighbours &NearVoxels::tree() const {
    std::call_once(tree_made_, [&] { tree_ = std::make_unique<VoxelNeighbours>(codes_); });
    return *tree_;
}

void NearVoxelCursor::gather(MortonCode cell) {
    cell_ = cell;
    around_.clear();
    for (auto &axis : places_)
        axis.clear();
    const auto centre = morton_decode(cell);
    const int cells = 1 << (voxels_.depth_ - kCellBits);
    std::array<MortonCode, 27> near;
    std::size_t count = 0;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const std::array<int, 3> at{static_cast<int>(centre[0]) + x, static_cast<int>(centre[1]) + y,
                                            static_cast<int>(centre[2]) + z};
                if (std::all_of(at.begin(), at.end(), [&](int c) { return c >= 0 && c < cells; }))
                    near[count++] = morton_encode(static_cast<std::uint32_t>(at[0]), static_cast<std::uint32_t>(at[1]),
                                                  static_cast<std::uint32_t>(at[2]));
            }
    std::sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count));
    const std::span<const MortonCode> codes = voxels_.codes_;
    for (const MortonCode other : std::span(near).first(count))
        for (std::size_t i = voxels_.first_not_below(other << 3 * kCellBits);
             i < codes.size() && codes[i] >> 3 * kCellBits == other; ++i) {
            const auto at = morton_decode(codes[i]);
            around_.push_back(static_cast<std::uint32_t>(i));
            for (std::size_t axis = 0; axis < 3; ++axis)
                places_[axis].push_back(
                    static_cast<std::int16_t>(static_cast<int>(at[axis] - (centre[axis] << kCellBits))));
        }
    squared_.resize(around_.size());
    close_.resize(around_.size() + 1);
}

std::size_t NearVoxelCursor::nearest(std::size_t voxel, std::span<Neighbour> found) {
    assert(found.size() <= VoxelNeighbours::kMost);
    const MortonCode code = voxels_.codes_[voxel];
    if (voxels_.depth_ <= kCellBits)
        return voxels_.tree().nearest(voxel, found);
    if (code >> 3 * kCellBits != cell_)
        gather(code >> 3 * kCellBits);
    const auto centre = morton_decode(code & ((1U << 3 * kCellBits) - 1)); // in its cell
    const auto x = static_cast<std::int16_t>(centre[0]), y = static_cast<std::int16_t>(centre[1]),
               z = static_cast<std::int16_t>(centre[2]);
    for (std::size_t i = 0; i < squared_.size(); ++i) { // eight at once
        const auto dx = static_cast<std::int16_t>(places_[0][i] - x), dy = static_cast<std::int16_t>(places_[1][i] - y),
                   dz = static_cast<std::int16_t>(places_[2][i] - z);
        squared_[i] = static_cast<std::int16_t>(dx * dx + dy * dy + dz * dz);
    }
    constexpr int kFarthest = kReach * kReach;
    std::size_t close = 0;
    for (std::size_t i = 0; i < squared_.size(); ++i) {
        close_[close] = static_cast<std::uint32_t>(i);
        close += squared_[i] <= kFarthest ? 1 : 0;
    }
    std::array<std::uint32_t, kFarthest + 1> counts{};
    for (const std::uint32_t i : std::span(close_).first(close))
        ++counts[static_cast<std::size_t>(squared_[i])];
    counts[0] = 0; // itself
    std::array<std::uint32_t, kFarthest + 2> place{};
    for (std::size_t d = 1; d <= kFarthest; ++d)
        place[d + 1] = place[d] + counts[d];
    if (place[kFarthest + 1] < found.size())
        return voxels_.tree().nearest(voxel, found);
    for (const std::uint32_t i : std::span(close_).first(close)) {
        const auto d = static_cast<std::size_t>(squared_[i]);
        if (d > 0 && place[d] < found.size())
            found[place[d]++] = {around_[i], static_cast<float>(d)};
    }
    return found.size();
}

} // namespace pbm::build
