#include "pbm_build/voxels/stored_offsets.h"

#include "pbm_format/levels/chunk_split.h"
#include "pbm_surface/surface_offsets.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

constexpr std::size_t kFewest = 64, kFewestOf = 2000; // points; one of so many

// Places, nodes and first points of the bricks of a chunk with these voxels: all that an estimate reads of them.
std::vector<BrickRecord> bricks_of(std::span<const MortonCode> codes) {
    std::vector<BrickRecord> bricks;
    std::uint16_t node = 0;
    for (std::size_t point = 0; point < codes.size(); ++point) {
        const MortonCode code = codes[point];
        if (point == 0 || code >> 9 != codes[point - 1] >> 9) {
            const auto place = morton_decode(code >> 9);
            BrickRecord &brick = bricks.emplace_back();
            brick.x = static_cast<std::uint16_t>(place[0]);
            brick.y = static_cast<std::uint16_t>(place[1]);
            brick.z = static_cast<std::uint16_t>(place[2]);
            brick.first_point = static_cast<std::uint16_t>(point);
            brick.first_node = node;
        }
        if (const std::uint64_t bit = std::uint64_t{1} << (code >> 3 & 63); (bricks.back().node_map & bit) == 0) {
            bricks.back().node_map |= bit;
            ++node;
        }
    }
    return bricks;
}

// The offsets of a chunk, whose points are numbered from `first_point` on.
Offsets choose_in_chunk(const Voxels &voxels, const ChunkShape &shape, ByteView masks, std::size_t first_point) {
    const std::vector<BrickRecord> bricks = bricks_of(std::span(voxels.codes).subspan(first_point, shape.points));
    ChunkView view;
    view.masks = masks;
    view.normals = std::span(voxels.points.normals).subspan(first_point, shape.points);
    view.bricks = bricks;
    struct Scratch {
        SurfaceOffsets surface;
        std::vector<std::int8_t> estimated;
    };
    Scratch &scratch = per_thread<Scratch>();
    scratch.estimated.resize(shape.points);
    scratch.surface.estimate(view, scratch.estimated);
    Offsets chosen;
    for (std::size_t i = 0; i < shape.points; ++i) {
        const std::size_t point = first_point + i;
        const std::int8_t offset = voxels.offsets[point];
        if (offset == kNoOffset)
            continue;
        const double error = static_cast<double>(offset_of(scratch.estimated[i])) - // positive: too high
                             static_cast<double>(offset) / Offsets::kSteps;
        if (error < kTooHigh && error > -kTooDeep)
            continue;
        chosen.points.push_back(static_cast<std::uint32_t>(point));
        chosen.values.push_back(offset);
    }
    return chosen;
}

} // namespace

Offsets choose_offsets(const Voxels &voxels, int depth, int threads) {
    const LevelMasks masks = encode_octree(voxels.codes, depth);
    const std::vector<ChunkShape> shapes = split_into_chunks(masks, kDefaultChunkPoints).back();
    std::vector<std::array<std::size_t, 2>> starts{{0, 0}}; // first node and first point of each chunk
    for (const ChunkShape &shape : shapes)
        starts.push_back({starts.back()[0] + shape.nodes, starts.back()[1] + shape.points});
    std::vector<Offsets> of_chunks(shapes.size());
    parallel_for(shapes.size(), threads, [&](std::size_t i) {
        const ByteView of_chunk = ByteView(masks.back()).subspan(starts[i][0], shapes[i].nodes);
        of_chunks[i] = choose_in_chunk(voxels, shapes[i], of_chunk, starts[i][1]);
    });
    Offsets all;
    for (const Offsets &some : of_chunks) {
        all.points.insert(all.points.end(), some.points.begin(), some.points.end());
        all.values.insert(all.values.end(), some.values.begin(), some.values.end());
    }
    return all.size() < std::max(kFewest, voxels.codes.size() / kFewestOf) ? Offsets() : all;
}

} // namespace pbm::build
