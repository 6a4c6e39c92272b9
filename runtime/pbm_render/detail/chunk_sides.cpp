#include "pbm_render/detail/chunk_sides.h"

#include "pbm_format/chunks/brick_index.h"
#include "pbm_format/chunks/point_stream_chunk.h"
#include "pbm_format/model/octree.h"
#include "pbm_render/camera/normal_table.h"

#include <algorithm>
#include <bit>

namespace pbm {
namespace {

// Writes a lit fraction of `bits` bits.
void set_packed(Bytes &packed, std::size_t i, unsigned bits, std::uint8_t value) {
    const std::size_t at = i * bits;
    const unsigned shift = at % 8, mask = ((1U << bits) - 1) << shift;
    packed[at / 8] = static_cast<std::uint8_t>((packed[at / 8] & ~mask) | unsigned{value} << shift);
}

// Gives all points of the chunk the values of `view`, but those with sides their first one.
void show_first(const Sides &sides, const AttributeSet &set, int level, ChunkView &view, SideColumns &first) {
    first.points.normals.assign(view.normals.begin(), view.normals.end());
    for (std::size_t i = 0; i < sides.size(); ++i)
        first.points.normals[sides.points[i]] = sides.values.normals[2 * i];
    view.normals = first.points.normals;
    for (const StreamInfo &stream : side_streams(set)) {
        if (stream.kind == StreamKind::normal)
            continue;
        ByteView &values = view.values(stream);
        const Bytes &from = sides.values.values(stream);
        if (stream.kind == StreamKind::shadow) {
            Bytes &packed = first.packed_shadows[stream.light];
            packed.assign(values.begin(), values.end());
            for (std::size_t i = 0; i < sides.size(); ++i)
                set_packed(packed, sides.points[i], bits_per_point(stream, set, level), from[2 * i]);
            values = packed;
            continue;
        }
        const std::size_t width = bytes_per_point(stream, set);
        Bytes &column = first.points.values(stream);
        column.assign(values.begin(), values.end());
        for (std::size_t i = 0; i < sides.size(); ++i)
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(2 * width * i), width,
                        column.begin() + static_cast<std::ptrdiff_t>(width * sides.points[i]));
        values = column;
    }
}

// A mask of child number `rank` of those in `mask`, which has more.
unsigned child_of(unsigned mask, std::uint32_t rank) {
    for (; rank > 0; --rank)
        mask &= mask - 1;
    return mask & -mask;
}

// Lists masks and bricks of the points with sides, and bounds the bricks of the chunk that hold some anew: all others
// have the points that they had.
void place_second(std::span<BrickRecord> bricks, const ChunkView &chunk, ChunkSides &to) {
    const ByteView masks = chunk.masks;
    const std::size_t points = chunk.normals.size();
    std::size_t node = 0, side = 0, point = 0;
    for (BrickRecord &brick : bricks) {
        if (side == to.points.size())
            break;
        const std::size_t first_node = node, first_point = point;
        const auto nodes = static_cast<std::size_t>(std::popcount(brick.node_map));
        const auto below = count_children(slice(masks, node, std::min(nodes, masks.size() - node)));
        const std::size_t end_point = point + static_cast<std::size_t>(below);
        if (to.points[side] >= end_point) {
            node = std::min(node + nodes, masks.size());
            point = end_point;
            continue;
        }
        BrickRecord second{.x = brick.x, .y = brick.y, .z = brick.z};
        for (std::uint64_t map = brick.node_map; map != 0 && node < masks.size(); map &= map - 1) {
            const std::uint8_t mask = masks[node++];
            const std::size_t end = point + kChildren[mask];
            unsigned of_node = 0;
            for (; side < to.points.size() && to.points[side] < end; ++side)
                of_node |= child_of(mask, static_cast<std::uint32_t>(to.points[side] - point));
            point = end;
            if (of_node == 0)
                continue;
            second.node_map |= map & -map;
            to.masks.push_back(static_cast<std::uint8_t>(of_node));
        }
        if (second.node_map == 0)
            continue;
        to.bricks.push_back(second);
        if (point > points) // the bytes have changed
            break;
        bound_bricks(masks.subspan(first_node, node - first_node),
                     chunk.normals.subspan(first_point, point - first_point),
                     chunk.radii.subspan(first_point, point - first_point), {&brick, 1});
        brick.first_node = static_cast<std::uint16_t>(first_node);
        brick.first_point = static_cast<std::uint16_t>(first_point);
    }
    to.points.resize(side); // the bytes have changed: fewer
}

} // namespace

std::array<std::uint32_t, 2> ChunkSides::range(std::uint32_t first_point, std::uint32_t last_point) const {
    const auto at = [&](std::uint32_t point) {
        return static_cast<std::uint32_t>(std::lower_bound(points.begin(), points.end(), point) - points.begin());
    };
    return {at(first_point), at(last_point)};
}

std::uint64_t ChunkSides::memory_of(const ChunkEntry &chunk, const AttributeSet &set, std::uint64_t raw_bytes) {
    if (raw_bytes == 0)
        return 0;
    std::uint64_t row = 0;
    for (const StreamInfo &stream : streams_of(set))
        row += bytes_per_point(stream, set);
    ChunkShape second = chunk.shape;
    const std::uint64_t pairs_of_normals = raw_bytes / (2 * sizeof(std::uint16_t));
    second.points = static_cast<std::uint32_t>(std::min<std::uint64_t>(second.points, pairs_of_normals));
    second.nodes = std::min(second.nodes, second.points);
    second.bricks = std::min(second.bricks, second.points);
    return chunk.shape.points * row + 3 * raw_bytes + ChunkOffsets::memory_of(second) +
           (chunk.shape.bricks + second.bricks) * kBrickRecordBytes;
}

void split_sides(Sides sides, const AttributeSet &set, int level, std::span<BrickRecord> bricks, ChunkView &view,
                 ChunkSides &to) {
    show_first(sides, set, level, view, to.first);
    to.points = std::move(sides.points);
    place_second(bricks, view, to);
    view.bricks = bricks;
    const std::size_t count = to.points.size();
    to.second.points.resize(count, set);
    for (std::size_t i = 0; i < count; ++i) {
        to.second.points.normals[i] = sides.values.normals[2 * i + 1];
        to.second.points.radii[i] = view.radii[to.points[i]];
    }
    to.view.normals = to.second.points.normals;
    to.view.radii = to.second.points.radii;
    for (const StreamInfo &stream : side_streams(set)) {
        if (stream.kind == StreamKind::normal)
            continue;
        const std::size_t width = bytes_per_point(stream, set);
        const Bytes &from = sides.values.values(stream);
        Bytes &column = to.second.points.values(stream);
        for (std::size_t i = 0; i < count; ++i)
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(width * (2 * i + 1)), width,
                        column.begin() + static_cast<std::ptrdiff_t>(width * i));
        to.view.values(stream) = column;
        if (stream.kind == StreamKind::shadow) {
            to.second.packed_shadows[stream.light] = pack_bits(column, bits_per_point(stream, set, level));
            to.view.shadows[stream.light] = to.second.packed_shadows[stream.light];
        }
    }
    bound_bricks(to.masks, to.view.normals, to.view.radii, to.bricks);
    for (std::size_t i = 0; i < count; ++i) {
        to.first.points.normals[to.points[i]] |= kSideBits;
        to.second.points.normals[i] |= kSideBits;
    }
    to.view.masks = to.masks;
    to.view.bricks = to.bricks;
}

} // namespace pbm
