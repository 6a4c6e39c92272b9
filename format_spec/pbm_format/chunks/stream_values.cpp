#include "pbm_format/chunks/stream_values.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/streams/frame.h"

#include <algorithm>
#include <bit>

namespace pbm {

PointsOfChunk points_of(std::span<const std::uint32_t> points, const ChunkEntry &entry) {
    const auto at = [&](std::uint64_t point) {
        return static_cast<std::size_t>(std::lower_bound(points.begin(), points.end(), point) - points.begin());
    };
    const std::size_t first = at(entry.first_point);
    return {first, at(entry.first_point + entry.shape.points) - first};
}

Bytes encode_mask(std::span<const std::uint32_t> points, const ChunkEntry &entry) {
    Bytes mask(static_cast<std::size_t>(mask_bytes(entry.shape.points)), 0);
    for (const std::uint32_t point : points) {
        const auto place = static_cast<std::size_t>(point - entry.first_point);
        mask[place / 8] |= static_cast<std::uint8_t>(1U << place % 8);
    }
    return mask;
}

bool read_mask(ByteView raw, std::uint32_t chunk_points, std::vector<std::uint32_t> &to) {
    to.clear();
    const auto bytes = static_cast<std::size_t>(mask_bytes(chunk_points));
    if (raw.size() < bytes)
        return false;
    for (std::size_t byte = 0; byte < bytes; ++byte)
        for (unsigned left = raw[byte]; left != 0; left &= left - 1)
            to.push_back(static_cast<std::uint32_t>(8 * byte) + static_cast<std::uint32_t>(std::countr_zero(left)));
    return !to.empty() && to.back() < chunk_points;
}

Result<Bytes> decode_stream_values(const PointStreamEntry &entry, ByteView stored, PointStream kind, Wording wording) {
    if (const std::uint64_t hash = hash64(stored); hash != entry.hash)
        return broken(wording, "19.3.1", entry.offset,
                      "the " + std::string(to_string(kind)) + " of the chunk were changed: their hash does not match",
                      hash_value(entry.hash), hash_value(hash));
    Bytes raw(entry.raw_bytes);
    if (raw.empty())
        return raw;
    if (Status status = decode_frame(stored, entry.zstd, raw, entry.offset, wording); !status)
        return std::move(status).error();
    return raw;
}

} // namespace pbm
