#include "pbm_render/surface_offsets.h"

#include "pbm_format/normal.h"
#include "pbm_format/octree.h"

#include <algorithm>
#include <bit>

namespace pbm {
namespace {

constexpr float kSameSide = 0.5F;      // cosine
constexpr float kReach2 = 1.5F * 1.5F; // voxels from the line along the normal where weights end, squared
constexpr float kFarthest = 1.8F;      // voxels along the normal: no voxel of the same surface is farther

std::size_t hash(const std::array<std::uint32_t, 3> &place) {
    return (place[0] * 0x9E3779B1U ^ place[1] * 0x85EBCA77U ^ place[2] * 0xC2B2AE3DU) * 0x27D4EB2FU >> 7;
}

} // namespace

void SurfaceOffsets::list_bricks(const ChunkView &chunk) {
    bricks_.clear();
    places_.assign(chunk.normals.size(), 0);
    table_.assign(std::bit_ceil(2 * chunk.bricks.size() + 1), 0);
    for (const BrickRecord &record : chunk.bricks) {
        const BrickRecord brick = record; // bytes of a mapped chunk may change
        std::size_t point = brick.first_point, node = brick.first_node;
        for (std::uint64_t map = brick.node_map; map != 0 && node < chunk.masks.size(); map &= map - 1, ++node)
            for (unsigned mask = chunk.masks[node]; mask != 0 && point < places_.size(); mask &= mask - 1)
                places_[point++] = static_cast<std::uint16_t>(8 * std::countr_zero(map) + std::countr_zero(mask));
        bricks_.push_back({{brick.x, brick.y, brick.z}, brick.first_point, point});
        std::size_t slot = hash(bricks_.back().place) & (table_.size() - 1);
        while (table_[slot] != 0)
            slot = (slot + 1) & (table_.size() - 1);
        table_[slot] = static_cast<std::uint32_t>(bricks_.size());
    }
}

const SurfaceOffsets::Brick *SurfaceOffsets::find(const std::array<std::uint32_t, 3> &place) const {
    for (std::size_t slot = hash(place) & (table_.size() - 1); table_[slot] != 0;
         slot = (slot + 1) & (table_.size() - 1))
        if (const Brick &brick = bricks_[table_[slot] - 1]; brick.place == place)
            return &brick;
    return nullptr;
}

// Fills around_ with the points of a brick and of one voxel around it.
void SurfaceOffsets::gather(const ChunkView &chunk, const Brick &brick) {
    for (const std::int16_t at : filled_)
        around_[static_cast<std::size_t>(at)] = {};
    filled_.clear();
    const auto normals = normal_table();
    for (std::uint32_t shift = 0; shift < 27; ++shift) {
        const Brick *const from =
            find({brick.place[0] + shift % 3 - 1, brick.place[1] + shift / 3 % 3 - 1, brick.place[2] + shift / 9 - 1});
        if (from == nullptr)
            continue;
        const auto &padded = padded_places()[shift];
        for (std::size_t i = from->first; i < from->end; ++i)
            if (const std::int16_t at = padded[places_[i]]; at >= 0) {
                const UnitVector &n = normals[chunk.normals[i] & kNormalIndexMask];
                around_[static_cast<std::size_t>(at)] = {static_cast<float>(n[0]), static_cast<float>(n[1]),
                                                         static_cast<float>(n[2])};
                filled_.push_back(at);
            }
    }
}

float SurfaceOffsets::mean_along(const Normal &normal, std::size_t at) const {
    float sum = 0, weights = 0;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const Normal &other = *(&around_[at] + z * kPaddedSlice + y * kPaddedEdge + x);
                const float cosine = normal.x * other.x + normal.y * other.y + normal.z * other.z;
                if (cosine < kSameSide)
                    continue;
                const float along = normal.x * static_cast<float>(x) + normal.y * static_cast<float>(y) +
                                    normal.z * static_cast<float>(z);
                const float aside2 = static_cast<float>(x * x + y * y + z * z) - along * along;
                if (std::max(along, -along) > kFarthest || aside2 >= kReach2)
                    continue;
                const float weight = 1 - aside2 / kReach2;
                const float across = (normal.x + other.x) * static_cast<float>(x) +
                                     (normal.y + other.y) * static_cast<float>(y) +
                                     (normal.z + other.z) * static_cast<float>(z);
                sum += weight * across / (1 + cosine);
                weights += weight;
            }
    return weights > 0 ? sum / weights : 0;
}

void SurfaceOffsets::estimate(const ChunkView &chunk, std::span<std::int8_t> to) {
    std::fill(to.begin(), to.end(), std::int8_t{0});
    list_bricks(chunk);
    const auto &middle = padded_places()[kMiddleBrick];
    for (const Brick &brick : bricks_) {
        gather(chunk, brick);
        for (std::size_t i = brick.first; i < brick.end; ++i) {
            if ((chunk.normals[i] & kTwoSidedBit) != 0)
                continue;
            const auto at = static_cast<std::size_t>(middle[places_[i]]);
            const float steps = mean_along(around_[at], at) * kOffsetSteps;
            to[i] = static_cast<std::int8_t>(std::clamp(steps, -127.0F, 127.0F));
        }
    }
}

ChunkOffsets::ChunkOffsets(std::size_t points) : offsets_(points) {}

const std::int8_t *ChunkOffsets::of(const ChunkView &chunk, SurfaceOffsets &workplace) const {
    std::call_once(estimated_, [&] { workplace.estimate(chunk, offsets_); });
    return offsets_.data();
}

} // namespace pbm
