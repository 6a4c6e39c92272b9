#include "pbm_format/chunks/offset_chunk.h"

#include <algorithm>

namespace pbm {

Bytes encode_offsets(const Offsets &offsets, const ChunkEntry &entry) {
    const auto [first, count] = points_of(offsets.points, entry);
    if (count == 0)
        return {};
    Bytes raw = encode_mask(std::span(offsets.points).subspan(first, count), entry);
    const auto values = std::span(offsets.values).subspan(first, count);
    raw.insert(raw.end(), values.begin(), values.end());
    return raw;
}

Status decode_offsets(const PointStreamEntry &entry, ByteView stored, std::uint32_t chunk_points, Wording wording,
                      Offsets &to) {
    to = {};
    const Result<Bytes> raw = decode_stream_values(entry, stored, PointStream::offsets, wording);
    if (!raw)
        return raw.error();
    if (raw->empty())
        return {};
    const bool is_mask = read_mask(*raw, chunk_points, to.points);
    const std::uint64_t whole = mask_bytes(chunk_points) + to.size();
    if (!is_mask || raw->size() != whole)
        return broken(wording, "19.6.1", entry.offset,
                      "the offsets are not a mask of the chunk's points and a byte for each that it marks",
                      is_mask ? Value(whole) : Value("a mask"), raw->size());
    to.values.assign(raw->end() - static_cast<std::ptrdiff_t>(to.size()), raw->end());
    const auto [least, most] = std::minmax_element(to.values.begin(), to.values.end());
    if (*least < -Offsets::kMost || *most > Offsets::kMost)
        return broken(wording, "19.6.2", entry.offset, "an offset is beyond the voxel", "-14..14",
                      static_cast<int>(*least < -Offsets::kMost ? *least : *most));
    return {};
}

} // namespace pbm
