// Law: the values of a point stream (BVG.md 19) of any bytes, with the right hash, are refused or decode to values that
// obey its rules; then their encoding is these bytes again.
// Input: kind, attributes, the number of the chunk's points, whether the stored bytes are a frame of zstd; then the
// bytes.
#include "pbm_format/chunks/point_stream_chunk.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/writing/frame_encoder.h"

#include "fuzz/byte_source.h"
#include "unit/support/test_models.h"

#include <algorithm>
#include <cstdlib>

namespace {

using namespace pbm;

constexpr int kLevel = 5;
constexpr std::size_t kMaterials = 3;
constexpr std::uint32_t kMaxChunkPoints = 70; // a mask of some bytes, and values behind it

void expect(bool law) {
    if (!law)
        std::abort();
}

bool are_marked(const std::vector<std::uint32_t> &points, std::uint32_t chunk_points) {
    return !points.empty() && std::ranges::is_sorted(points, std::less_equal()) && points.back() < chunk_points;
}

void try_offsets(const PointStreamEntry &entry, ByteView stored, ByteView raw, const ChunkEntry &chunk) {
    Offsets offsets;
    if (!decode_offsets(entry, stored, chunk.shape.points, Wording::full, offsets))
        return;
    expect(raw.empty() ? offsets.size() == 0 : are_marked(offsets.points, chunk.shape.points));
    expect(offsets.values.size() == offsets.size());
    for (const std::int8_t value : offsets.values)
        expect(std::abs(value) <= Offsets::kMost);
    expect(std::ranges::equal(encode_offsets(offsets, chunk), raw));
}

void try_sides(const PointStreamEntry &entry, ByteView stored, ByteView raw, const ChunkEntry &chunk,
               const AttributeSet &set) {
    const ChunkRules rules{.set = set, .material_count = kMaterials, .level = kLevel, .finest = true};
    Sides sides;
    if (!decode_sides(entry, stored, chunk, rules, sides))
        return;
    expect(raw.empty() ? sides.size() == 0 : are_marked(sides.points, chunk.shape.points));
    for (const std::uint16_t normal : sides.values.normals)
        expect(normal <= kNormalIndexMask);
    for (const std::uint8_t material : sides.values.materials)
        expect(material < kMaterials);
    expect(std::ranges::equal(encode_sides(sides, chunk, set, kLevel), raw));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size == 0)
        return 0;
    test::ByteSource input(ByteView(data, size));
    const bool is_offsets = input.below(2) == 0, has_all = input.below(2) == 0, is_packed = input.below(2) == 0;
    const AttributeSet set = has_all ? test::every_attribute(ColourFormat::rgb888, kLevel) : AttributeSet{};
    ChunkEntry chunk;
    chunk.shape.points = 1 + static_cast<std::uint32_t>(input.below(kMaxChunkPoints));
    const Bytes raw = input.bytes(input.below(300));
    Bytes stored;
    const bool is_frame = is_packed && !raw.empty() && append_frame(raw, 1, stored).zstd;
    if (!is_frame)
        stored = raw;
    const PointStreamEntry entry{.hash = hash64(stored),
                                 .stored_bytes = static_cast<std::uint32_t>(stored.size()),
                                 .raw_bytes = static_cast<std::uint32_t>(raw.size()),
                                 .zstd = is_frame};
    if (is_offsets)
        try_offsets(entry, stored, raw, chunk);
    else
        try_sides(entry, stored, raw, chunk, set);
    return 0;
}
