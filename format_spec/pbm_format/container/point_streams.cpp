#include "pbm_format/container/point_streams.h"

#include "pbm_format/law/catalogue.h"

namespace pbm {
namespace {

// 19.2.2 to 19.2.4
Status check_entry(const PointStreamEntry &entry, Filter filter, std::uint64_t points, bool mapped, std::uint64_t at) {
    const std::uint64_t raw = entry.raw_bytes, most = kMaxPointStreamBytes * points;
    if (filter != Filter::none)
        return broken("19.2.2", at + 8, "a point stream with a filter this program does not know", 0,
                      static_cast<unsigned>(filter));
    const bool possible = raw <= most && (entry.zstd ? !mapped && entry.stored_bytes > 0 && entry.stored_bytes < raw
                                                     : entry.stored_bytes == raw);
    if (!possible)
        return broken("19.2.3", at + 8, "the stored or raw size of a point stream is impossible",
                      "at most " + std::to_string(most) + " raw bytes, and no more stored ones",
                      std::to_string(raw) + " raw, " + std::to_string(entry.stored_bytes) + " stored");
    if (raw / kMaxExpansion > entry.stored_bytes)
        return broken("19.2.4", at + 8, "a point stream expands more than 32,768 times",
                      "at least " + std::to_string(raw / kMaxExpansion) + " bytes", entry.stored_bytes);
    return {};
}

} // namespace

Result<std::vector<PointStreamEntry>> decode_stream_directory(ByteView bytes, const LevelDirectory &level,
                                                              const SectionEntry &values) {
    if (bytes.size() % kPointStreamEntryBytes != 0 || bytes.size() / kPointStreamEntryBytes != level.chunks.size())
        return broken("19.2.1", 0, "the directory of a point stream has not one entry per chunk",
                      level.chunks.size() * kPointStreamEntryBytes, bytes.size());
    std::vector<PointStreamEntry> entries;
    entries.reserve(level.chunks.size());
    ByteReader in(bytes);
    std::uint64_t stored = 0, raw = 0;
    for (const ChunkEntry &chunk : level.chunks) {
        const std::uint64_t at = in.offset();
        PointStreamEntry &entry = entries.emplace_back();
        entry.hash = in.u64();
        const StreamEntry stream = unpack_stream_entry(in.u32());
        entry.stored_bytes = stream.stored_bytes;
        entry.zstd = stream.zstd;
        entry.raw_bytes = in.u32();
        entry.offset = values.offset + stored;
        if (const Status status = check_entry(entry, stream.filter, chunk.shape.points, values.codec == Codec::raw, at);
            !status)
            return status.error();
        stored += entry.stored_bytes;
        raw += entry.raw_bytes;
    }
    if (stored != values.stored_bytes || raw != values.raw_bytes || level.points != values.count)
        return broken("19.2.5", bytes.size(),
                      "sums over the point streams of all chunks are not those of the section table",
                      std::to_string(values.stored_bytes) + " stored bytes, " + std::to_string(values.raw_bytes) +
                          " raw, " + std::to_string(values.count) + " points",
                      std::to_string(stored) + " stored bytes, " + std::to_string(raw) + " raw, " +
                          std::to_string(level.points) + " points");
    return entries;
}

Bytes encode_stream_directory(std::span<const PointStreamEntry> entries) {
    ByteWriter out;
    for (const PointStreamEntry &entry : entries) {
        out.u64(entry.hash);
        out.u32(pack_stream_entry({.stored_bytes = entry.stored_bytes, .zstd = entry.zstd}));
        out.u32(entry.raw_bytes);
    }
    return out.take();
}

} // namespace pbm
