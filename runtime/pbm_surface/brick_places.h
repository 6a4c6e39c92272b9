// Lists the positions of a brick's points within the brick. For files that Highway compiles for several targets:
// include it after highway.h, once per target.
#if defined(PBM_SURFACE_BRICK_PLACES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_SURFACE_BRICK_PLACES_H
#undef PBM_SURFACE_BRICK_PLACES_H
#else
#define PBM_SURFACE_BRICK_PLACES_H
#endif

#include "pbm_format/model/octree.h"
#include "pbm_surface/brick_points.h"
#include "system/bytes.h"

#include <array>
#include <bit>
#include <cstdint>

#ifndef PBM_SURFACE_BRICK_PLACES_TABLES
#define PBM_SURFACE_BRICK_PLACES_TABLES
namespace pbm {

// Position of a voxel in its brick: x + 16 y + 256 z, each 0..7.
using VoxelPlace = std::uint16_t;

constexpr VoxelPlace voxel_place(std::size_t morton) {
    std::uint32_t place = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t bit = 0; bit < 3; ++bit)
            place |= static_cast<std::uint32_t>(morton >> (3 * bit + axis) & 1) << (4 * axis + bit);
    return static_cast<VoxelPlace>(place);
}

// [mask][8]: positions of the children of a child mask, in order.
inline constexpr std::array<std::array<VoxelPlace, 8>, 256> kChildPlaces = [] {
    std::array<std::array<VoxelPlace, 8>, 256> places{};
    for (std::size_t mask = 0; mask < 256; ++mask) {
        std::size_t n = 0;
        for (std::size_t child = 0; child < 8; ++child)
            if ((mask >> child & 1) != 0)
                places[mask][n++] = voxel_place(child);
    }
    return places;
}();

// [node]: position of the first child of each of a brick's 64 nodes.
inline constexpr std::array<VoxelPlace, 64> kNodePlaces = [] {
    std::array<VoxelPlace, 64> places{};
    for (std::size_t node = 0; node < 64; ++node)
        places[node] = voxel_place(8 * node);
    return places;
}();

// Positions of a brick's points in stream order, padded to whole SIMD vectors.
struct BrickPlaces {
    alignas(64) std::array<VoxelPlace, kBrickPoints + kMaxLanes> place;
};

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Writes the positions of all points of a brick and returns their number. `node_map` marks the brick's nodes, `masks`
// starts with their child masks; a node whose mask is missing has no points.
inline HWY_NOINLINE std::size_t list_places(std::uint64_t node_map, ByteView masks, BrickPlaces &to) {
    const std::uint8_t *mask = masks.data();
    const std::uint8_t *const end = mask + masks.size();
    std::size_t count = 0;
    for (std::uint64_t map = node_map; map != 0 && mask != end; map &= map - 1, ++mask) {
        const VoxelPlace node = kNodePlaces[static_cast<std::size_t>(std::countr_zero(map))];
        const std::array<VoxelPlace, 8> &children = kChildPlaces[*mask];
#if HWY_TARGET == HWY_SCALAR
        for (std::size_t i = 0; i < children.size(); ++i)
            to.place[count + i] = node | children[i];
#else
        const hn::FixedTag<VoxelPlace, 8> d;
        hn::StoreU(hn::Or(hn::Set(d, node), hn::LoadU(d, children.data())), d, to.place.data() + count);
#endif
        count += kChildren[*mask];
    }
    return count;
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
