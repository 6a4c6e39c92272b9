// Decodes whole models for measure.mjs: WebAssembly has no clock and no files.
#include "pbm_format/reading/reader.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace pbm;

// Chunks of the levels above the finest one, and one for all chunks of that level: memory is reused by the next run.
std::vector<std::vector<Chunk>> kept;
Chunk finest;

// Returns the points of the finest level, or 0 if the file is damaged.
std::uint64_t decode(ByteView file) {
    Result<Reader> reader = Reader::open(file);
    if (!reader)
        return 0;
    const int depth = reader->depth();
    kept.resize(static_cast<std::size_t>(depth));
    kept[0] = {reader->root_chunk()};
    std::uint64_t points = 0;
    for (int level = 1; level <= depth; ++level) {
        const Result<const LevelDirectory *> directory = reader->directory(level);
        if (!directory)
            return 0;
        const std::vector<ChunkEntry> &chunks = (*directory)->chunks;
        if (level < depth)
            kept[static_cast<std::size_t>(level)].resize(chunks.size());
        const std::vector<Chunk> &parents = kept[static_cast<std::size_t>(level) - 1];
        for (std::uint32_t i = 0; i < chunks.size(); ++i) {
            const std::optional<ChunkBytes> bytes = reader->chunk_bytes(level, i);
            const Chunk &parent = parents[level == 1 ? 0 : chunks[i].shape.parent_chunk];
            Chunk &to = level < depth ? kept[static_cast<std::size_t>(level)][i] : finest;
            if (!bytes || !reader->load_chunk(level, i, *bytes, parent, to))
                return 0;
            points += level == depth ? chunks[i].shape.points : 0;
        }
    }
    return points;
}

} // namespace

extern "C" double pbm_bench_decode(const std::uint8_t *bytes, std::size_t size) {
    return static_cast<double>(decode({bytes, size}));
}
