#include "pbm_render/surface_offsets.h"

#include "pbm_format/normal.h"
#include "pbm_format/octree.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace pbm {
namespace {

// The mean of the voxels around lies nearer to the centre than the surface, since those that it passes farther out are
// missing in a cube of three; the least squares over scans and shapes.
constexpr float kStretch = 1.12F;
constexpr float kCrammed = 11; // fewer empty voxels among the 27 than a surface leaves

struct Normal {
    float x, y, z;
};

const std::vector<Normal> &float_normals() {
    static const std::vector<Normal> normals = [] {
        std::vector<Normal> all;
        all.reserve(kNormalCount);
        for (const UnitVector &n : normal_table())
            all.push_back({static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
        return all;
    }();
    return normals;
}

// The eight bits of a row as bytes.
constexpr std::array<std::uint64_t, 256> kSpread = [] {
    std::array<std::uint64_t, 256> all{};
    for (std::size_t row = 0; row < 256; ++row)
        for (std::size_t bit = 0; bit < 8; ++bit)
            all[row] |= static_cast<std::uint64_t>(row >> bit & 1) << (8 * bit);
    return all;
}();

std::size_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return (x * 0x9E3779B1U ^ y * 0x85EBCA77U ^ z * 0xC2B2AE3DU) * 0x27D4EB2FU >> 7;
}

struct BrickNode {
    std::size_t x, y, z; // of its first voxel
};

BrickNode node_of(std::uint64_t map) {
    const auto [x, y, z] = morton_decode(static_cast<MortonCode>(std::countr_zero(map)));
    return {2 * std::size_t{x}, 2 * std::size_t{y}, 2 * std::size_t{z}};
}

// visit(node, mask) for the nodes of a brick that the chunk's masks tell of.
template <class Visit> void visit_nodes(const BrickRecord &brick, ByteView masks, Visit &&visit) {
    std::size_t at = brick.first_node;
    for (std::uint64_t map = brick.node_map; map != 0 && at < masks.size(); map &= map - 1, ++at)
        visit(node_of(map), masks[at]);
}

} // namespace

void SurfaceOffsets::find_rows(const ChunkView &chunk) {
    places_.clear();
    rows_.assign(chunk.bricks.size(), {});
    table_.assign(std::bit_ceil(2 * chunk.bricks.size() + 1), 0);
    for (std::size_t b = 0; b < chunk.bricks.size(); ++b) {
        const BrickRecord brick = chunk.bricks[b];
        places_.push_back({brick.x, brick.y, brick.z});
        Rows &rows = rows_[b];
        visit_nodes(brick, chunk.masks, [&](const BrickNode &node, unsigned mask) {
            for (std::size_t pair = 0; pair < 4; ++pair)
                rows[node.z + pair / 2][node.y + pair % 2] |=
                    static_cast<std::uint8_t>((mask >> 2 * pair & 3U) << node.x);
        });
        std::size_t slot = hash(brick.x, brick.y, brick.z) & (table_.size() - 1);
        while (table_[slot] != 0)
            slot = (slot + 1) & (table_.size() - 1);
        table_[slot] = static_cast<std::uint32_t>(b + 1);
    }
}

const SurfaceOffsets::Rows *SurfaceOffsets::find(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    for (std::size_t slot = hash(x, y, z) & (table_.size() - 1); table_[slot] != 0;
         slot = (slot + 1) & (table_.size() - 1))
        if (const std::size_t b = table_[slot] - 1; places_[b] == std::array{x, y, z})
            return &rows_[b];
    return nullptr;
}

// Fills occupied_ with a brick and the voxels around it.
void SurfaceOffsets::gather(std::size_t brick) {
    occupied_.fill(0);
    const auto [x, y, z] = places_[brick];
    // Of the bricks before, the same and after, along one axis: their first row that is wanted, and the one after the
    // last.
    constexpr std::array<std::size_t, 3> kFirst{kBrick - 1, 0, 0}, kEnd{kBrick, kBrick, 1};
    for (std::size_t dz = 0; dz < 3; ++dz)
        for (std::size_t dy = 0; dy < 3; ++dy)
            for (std::size_t dx = 0; dx < 3; ++dx) {
                const Rows *const from =
                    find(x + static_cast<std::uint32_t>(dx) - 1, y + static_cast<std::uint32_t>(dy) - 1,
                         z + static_cast<std::uint32_t>(dz) - 1);
                if (from == nullptr)
                    continue;
                for (std::size_t slice = kFirst[dz]; slice < kEnd[dz]; ++slice)
                    for (std::size_t line = kFirst[dy]; line < kEnd[dy]; ++line) {
                        const unsigned row = (*from)[slice][line];
                        std::int8_t *const to = occupied_.data() + (kBrick * dz + slice - kBrick + 1) * kSlice +
                                                (kBrick * dy + line - kBrick + 1) * kStride;
                        if (dx == 1)
                            std::memcpy(to + 1, &kSpread[row], kBrick);
                        else
                            to[dx == 0 ? 0 : kPadded - 1] = static_cast<std::int8_t>(dx == 0 ? row >> 7 : row & 1);
                    }
            }
}

// From occupied_ to sums_: along x, then y, then z, over whole rows, of which eight voxels count.
void SurfaceOffsets::add_up() {
    alignas(64) std::array<std::int8_t, kPadded * kSlice> count_x, from_x;
    alignas(64) std::array<std::int8_t, kPadded * kSumSlice> count_y, across_x, across_y;
    const auto byte = [](int value) { return static_cast<std::int8_t>(value); };
    for (std::size_t i = 0; i < count_x.size(); ++i) {
        count_x[i] = byte(occupied_[i] + occupied_[i + 1] + occupied_[i + 2]);
        from_x[i] = byte(occupied_[i + 2] - occupied_[i]);
    }
    for (std::size_t z = 0; z < kPadded; ++z)
        for (std::size_t i = 0; i < kSumSlice; ++i) {
            const std::int8_t *const count = count_x.data() + kSlice * z + i, *const from =
                                                                                  from_x.data() + kSlice * z + i;
            const std::size_t to = kSumSlice * z + i;
            count_y[to] = byte(count[0] + count[kStride] + count[2 * kStride]);
            across_x[to] = byte(from[0] + from[kStride] + from[2 * kStride]);
            across_y[to] = byte(count[2 * kStride] - count[0]);
        }
    for (std::size_t i = 0; i < kBrick * kSumSlice; ++i) {
        const std::size_t middle = i + kSumSlice, last = i + 2 * kSumSlice;
        sums_[0][i] = byte(across_x[i] + across_x[middle] + across_x[last]);
        sums_[1][i] = byte(across_y[i] + across_y[middle] + across_y[last]);
        sums_[2][i] = byte(count_y[last] - count_y[i]);
        sums_[3][i] = byte(count_y[i] + count_y[middle] + count_y[last]);
    }
}

// Of a point at a place of sums_.
std::int8_t SurfaceOffsets::offset(std::uint16_t normal, std::size_t place) const {
    if ((normal & kTwoSidedBit) != 0)
        return 0;
    const Normal &n = float_normals()[normal & kNormalIndexMask];
    const float along = n.x * static_cast<float>(sums_[0][place]) + n.y * static_cast<float>(sums_[1][place]) +
                        n.z * static_cast<float>(sums_[2][place]);
    const auto count = static_cast<float>(std::max<std::int8_t>(sums_[3][place], 1));
    // Of crammed voxels, as where scans lie over each other, the mean tells less and less.
    const float thin = std::min((27 - count) / kCrammed, 1.0F);
    return static_cast<std::int8_t>(std::clamp(thin * along * (kStretch * kOffsetSteps) / count, -127.0F, 127.0F));
}

void SurfaceOffsets::estimate(const ChunkView &chunk, std::vector<std::int8_t> &to) {
    to.assign(chunk.normals.size(), 0);
    find_rows(chunk);
    for (std::size_t b = 0; b < chunk.bricks.size(); ++b) {
        gather(b);
        add_up();
        const BrickRecord brick = chunk.bricks[b];
        std::size_t point = brick.first_point;
        visit_nodes(brick, chunk.masks, [&](const BrickNode &node, unsigned mask) {
            for (; mask != 0 && point < to.size(); mask &= mask - 1, ++point) {
                const auto child = static_cast<std::size_t>(std::countr_zero(mask));
                const std::size_t place =
                    (node.z + (child >> 2)) * kSumSlice + (node.y + (child >> 1 & 1)) * kStride + node.x + (child & 1);
                to[point] = offset(chunk.normals[point], place);
            }
        });
    }
}

} // namespace pbm
