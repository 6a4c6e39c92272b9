#include "pbm_build/offsets/stored_offsets.h"

#include "pbm_format/levels/chunk_split.h"
#include "pbm_format/writing/chunk_encoder.h"
#include "pbm_surface/surface_offsets.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

// The chunks of the finest level.
std::vector<ChunkEntry> finest_chunks(const LevelMasks &masks) {
    return place_chunks(split_into_chunks(masks, kDefaultChunkPoints).back());
}

// Appends the wrong estimates of a chunk.
void find_in_chunk(const Voxels &voxels, const ChunkEntry &chunk, ByteView masks, WrongEstimates &to) {
    const std::uint32_t points = chunk.shape.points;
    const auto first_point = static_cast<std::size_t>(chunk.first_point);
    const std::vector<BrickRecord> bricks = bricks_of(std::span(voxels.codes).subspan(first_point, points));
    ChunkView view;
    view.masks = masks;
    view.normals = std::span(voxels.points.normals).subspan(first_point, points);
    view.bricks = bricks;
    struct Scratch {
        SurfaceOffsets surface;
        std::vector<std::int8_t> estimated;
    };
    Scratch &scratch = per_thread<Scratch>();
    scratch.estimated.resize(points);
    scratch.surface.estimate(view, scratch.estimated);
    for (std::size_t i = 0; i < points; ++i) {
        const std::int8_t offset = voxels.offsets[first_point + i];
        if (offset == kNoOffset)
            continue;
        const double error = static_cast<double>(offset_of(scratch.estimated[i])) - // positive: too high
                             static_cast<double>(offset) / Offsets::kSteps;
        const double wrongness = std::max(error / kTooHigh, -error / kTooDeep);
        if (wrongness < 1)
            continue;
        to.offsets.points.push_back(static_cast<std::uint32_t>(first_point + i));
        to.offsets.values.push_back(offset);
        to.wrongness.push_back(static_cast<float>(wrongness));
    }
}

// Bytes of the chunks of all levels, without offsets.
double estimated_bytes(const Model &model, const WriteOptions &options) {
    constexpr std::size_t kOneIn = 8;
    constexpr double kCoarser = 1.15; // points of coarser levels take more bytes, and directories take some
    LevelMasks masks;
    std::size_t all_points = 0;
    for (const Level &level : model.levels) {
        masks.push_back(level.masks);
        all_points += level.points.size();
    }
    std::vector<ChunkEntry> chunks = finest_chunks(masks);
    const std::size_t count = (chunks.size() + kOneIn - 1) / kOneIn;
    std::vector<std::size_t> bytes(count), points(count);
    parallel_for(count, options.threads, [&](std::size_t i) {
        Bytes stored;
        ChunkEntry &chunk = chunks[kOneIn * i];
        const ChunkCoding coding{.compression_level = options.compression_level};
        const int depth = model.parameters.grid.depth;
        encode_chunk(model, depth, coding, chunk, stored);
        encode_point_stream(model, depth, PointStream::sides, coding, chunk, stored);
        for (std::size_t field = 0; field < model.parameters.fields.size(); ++field)
            encode_field(model, depth, field, chunk, coding, stored);
        bytes[i] = stored.size();
        points[i] = chunk.shape.points;
    });
    const auto sum = [](const std::vector<std::size_t> &of) { return std::reduce(of.begin(), of.end()); };
    return kCoarser * static_cast<double>(sum(bytes)) / static_cast<double>(sum(points)) *
           static_cast<double>(all_points);
}

// Bytes of so many offsets among `points` points: the entropy of the mask, and what values take after compression.
double bytes_of_offsets(double count, double points) {
    constexpr double kOfValue = 0.6;
    const auto entropy = [](double share) { return share > 0 ? -share * std::log2(share) : 0; };
    const double share = count / points;
    return points / 8 * (entropy(share) + entropy(1 - share)) + kOfValue * count;
}

} // namespace

WrongEstimates find_wrong_estimates(const Voxels &voxels, int depth, int threads) {
    WrongEstimates all;
    const LevelMasks masks = encode_octree(voxels.codes, depth);
    const std::vector<ChunkEntry> chunks = finest_chunks(masks);
    std::vector<WrongEstimates> of_chunks(chunks.size());
    parallel_for(chunks.size(), threads, [&](std::size_t i) {
        const ByteView of_chunk = ByteView(masks.back()).subspan(chunks[i].first_node, chunks[i].shape.nodes);
        find_in_chunk(voxels, chunks[i], of_chunk, of_chunks[i]);
    });
    const auto append = [](auto &to, const auto &from) { to.insert(to.end(), from.begin(), from.end()); };
    for (const WrongEstimates &some : of_chunks) {
        append(all.offsets.points, some.offsets.points);
        append(all.offsets.values, some.offsets.values);
        append(all.wrongness, some.wrongness);
    }
    return all;
}

Offsets choose_offsets(const WrongEstimates &wrong, const Model &model, double most_bytes,
                       const WriteOptions &options) {
    const double room = most_bytes - estimated_bytes(model, options);
    constexpr double kStep = 1.1, kWorst = 8; // of wrongness
    const auto bytes = [&](double least) {
        const auto count = std::count_if(wrong.wrongness.begin(), wrong.wrongness.end(),
                                         [&](float of) { return static_cast<double>(of) >= least; });
        return bytes_of_offsets(static_cast<double>(count), static_cast<double>(model.point_count()));
    };
    double least = 1;
    while (least < kWorst && bytes(least) > room)
        least *= kStep;
    Offsets chosen;
    if (least >= kWorst)
        return chosen;
    for (std::size_t i = 0; i < wrong.wrongness.size(); ++i)
        if (static_cast<double>(wrong.wrongness[i]) >= least) {
            chosen.points.push_back(wrong.offsets.points[i]);
            chosen.values.push_back(wrong.offsets.values[i]);
        }
    return chosen.size() < std::max(kFewest, model.point_count() / kFewestOf) ? Offsets() : chosen;
}

} // namespace pbm::build
