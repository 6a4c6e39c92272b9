// Law: a chunk with replaced streams and changed bytes, a right hash and sizes that a directory allows, is refused or
// decodes to values that obey every rule of chunks. In the second case the decoded streams, stored raw, decode to the
// same values.
// Input: model, level, whether the chunk keeps its normal cone; then a byte per stream that selects its replacement;
// then bytes to change, each with its offset.
#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/streams/frame.h"
#include "pbm_format/writing/chunk_encoder.h"
#include "pbm_format/writing/frame_encoder.h"
#include "pbm_format/writing/writer.h"

#include "fuzz/byte_source.h"
#include "unit/support/test_models.h"

#include <bit>
#include <cstdlib>

namespace {

using namespace pbm;

struct Original {
    Bytes file;
    Reader reader;
    Model model;
};

Original make_original(const Model &model, bool filters) {
    Bytes file = encode_model(model, {.compression_level = 3, .filters = filters, .threads = 1}).value();
    Reader reader = Reader::open(file).value();
    Model loaded = load_model(reader, {.threads = 1}).value();
    return {std::move(file), std::move(reader), std::move(loaded)};
}

// Models with filters have more points, so that filtering pays.
std::vector<Original> &originals() {
    static std::vector<Original> all = [] {
        std::vector<Original> some;
        for (const ColourFormat colour : {ColourFormat::rgb565, ColourFormat::rgb888})
            some.push_back(make_original(test::sphere_model(4, test::every_attribute(colour, 4), 0.3), true));
        some.push_back(
            make_original(test::sphere_model(3, test::every_attribute(ColourFormat::rgb888, 3), 0.2), false));
        some.push_back(make_original(test::sphere_model(4, {}, 0.3), true));
        return some;
    }();
    return all;
}

// A chunk of an original with its directory entry.
struct Place {
    const Original &original;
    ChunkRules rules;
    ChunkEntry entry;
    ChunkNodes nodes;

    const Level &level() const { return original.model.levels[static_cast<std::size_t>(rules.level)]; }
    std::uint64_t raw_bytes(const StreamInfo &stream) const {
        return raw_stream_bytes(stream, rules.set, rules.level, entry.shape.nodes, entry.shape.points);
    }
};

Place choose_place(test::ByteSource &input) {
    Original &original = originals()[input.below(originals().size())];
    const int level = 1 + static_cast<int>(input.below(static_cast<std::size_t>(original.reader.depth())));
    const LevelDirectory *directory = original.reader.directory(level).value();
    const ChunkEntry &entry = directory->chunks[input.below(directory->chunks.size())];
    const Level &above = original.model.levels[static_cast<std::size_t>(level) - 1];
    const AttributeSet &set = original.reader.parameters().attributes;
    return {original, original.reader.chunk_rules(level), entry,
            chunk_nodes(entry, above.masks, 0, above.points, 0, set)};
}

// Bytes with the same bits cleared in each: they more often obey the rules of values, and they compress.
Bytes masked_bytes(test::ByteSource &input, std::size_t size) {
    const std::uint8_t mask = input.next();
    Bytes bytes = input.bytes(size);
    for (std::uint8_t &byte : bytes)
        byte &= mask;
    return bytes;
}

// Planes of arbitrary bytes, with the sizes that the masks of the original require.
Bytes any_planes(const Place &place, const StreamInfo &stream, test::ByteSource &input) {
    const Filter filter = filter_of(stream, place.rules.set);
    const MaskSummary summary =
        summarise_masks(ByteView(place.level().masks).subspan(place.entry.first_node, place.entry.shape.nodes));
    const std::size_t codes = stream.kind == StreamKind::masks ? place.entry.shape.nodes
                              : stream.kind == StreamKind::radius || stream.kind == StreamKind::shadow
                                  ? place.raw_bytes(stream)
                                  : summary.children - summary.only_children;
    std::vector<Bytes> planes(plane_count(filter));
    for (std::size_t p = 0; p < std::max<std::size_t>(1, planes.size() - 1); ++p)
        planes[p] = masked_bytes(input, codes);
    if (planes.size() > 1) {
        // Mostly pairs and small escapes; otherwise the first check refuses nearly all inputs.
        Bytes &pairs = planes[planes.size() - 2];
        for (std::uint8_t &pair : pairs)
            pair = (pair & 15) == 15 ? 15 : pair;
        planes.back() = input.bytes(2 * count_escapes(pairs).count);
        for (std::uint8_t &escape : planes.back())
            escape &= 63;
    }
    Bytes stored, frames;
    for (const Bytes &plane : planes) {
        const StoredFrame frame = append_frame(plane, 1, frames);
        const std::uint32_t entry = frame.stored_bytes | (frame.zstd ? 1U << 31 : 0U);
        for (unsigned byte = 0; byte < kPlaneEntryBytes; ++byte)
            stored.push_back(static_cast<std::uint8_t>(entry >> 8 * byte));
    }
    stored.insert(stored.end(), frames.begin(), frames.end());
    return stored;
}

// Whether decode_directory accepts the entry. BVG.md 5.4
bool possible(const StreamEntry &stream, std::uint64_t raw, Filter filter) {
    if (stream.filter != Filter::none)
        return stream.stored_bytes >= kPlaneEntryBytes * plane_count(filter) && stream.stored_bytes < raw;
    return stream.zstd ? stream.stored_bytes != 0 && stream.stored_bytes < raw : stream.stored_bytes == raw;
}

// Keeps a stream or replaces it.
void store_stream(const Place &place, const StreamInfo &stream, ByteView kept, StreamEntry &entry, Bytes &out,
                  test::ByteSource &input) {
    const std::uint64_t raw = place.raw_bytes(stream);
    const Filter filter = filter_of(stream, place.rules.set);
    Bytes other;
    StreamEntry changed = entry;
    switch (input.next() % 16) {
    case 0: // arbitrary raw bytes
        other = masked_bytes(input, raw);
        changed = {.stored_bytes = 0, .filter = Filter::none, .zstd = false};
        break;
    case 1:
    case 2:
    case 3: // arbitrary codes
        other = any_planes(place, stream, input);
        changed = {.stored_bytes = 0, .filter = filter, .zstd = false};
        break;
    case 4: // arbitrary bytes of arbitrary size, marked as a frame
        other = input.bytes(input.below(raw));
        changed = {.stored_bytes = 0, .filter = Filter::none, .zstd = true};
        break;
    case 5: // arbitrary bytes of arbitrary size, marked as planes
        other = input.bytes(input.below(raw));
        changed = {.stored_bytes = 0, .filter = filter, .zstd = false};
        break;
    default: break;
    }
    if (changed != entry) {
        changed.stored_bytes = static_cast<std::uint32_t>(other.size());
        if (possible(changed, raw, filter)) {
            entry = changed;
            out.insert(out.end(), other.begin(), other.end());
            return;
        }
    }
    out.insert(out.end(), kept.begin(), kept.end());
}

void require(bool law) {
    if (!law)
        std::abort();
}

bool all_below(ByteView values, unsigned limit) {
    return std::all_of(values.begin(), values.end(), [&](std::uint8_t value) { return value < limit; });
}

void check_values(const Place &place, const Chunk &chunk) {
    const AttributeSet &set = place.rules.set;
    const PointAttributes &points = chunk.points;
    const std::size_t count = place.entry.shape.points;
    require(chunk.masks.size() == place.entry.shape.nodes && count_children(chunk.masks) == count);
    require(std::find(chunk.masks.begin(), chunk.masks.end(), 0) == chunk.masks.end());
    require(points.normals.size() == count && points.radii.size() == count);
    require(points.colours.size() == count * static_cast<std::size_t>(set.colour_bytes()));
    require(points.materials.size() == (set.material ? count : 0) &&
            points.textures.size() == (set.texture ? count : 0));
    const NormalCone cone = place.entry.cone;
    const IntegerNormal axis = integer_normal_table()[cone.axis];
    for (const std::uint16_t normal : points.normals) {
        require((normal & ~(kNormalIndexMask | kTwoSidedBit)) == 0);
        if (cone.cosine == kNoCone)
            continue;
        const IntegerNormal n = integer_normal_table()[normal & kNormalIndexMask];
        require((normal & kTwoSidedBit) == 0 &&
                axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2] >= cone.cosine * 32767);
    }
    require(!place.rules.finest || all_below(points.radii, kMaxFinestRadius + 1U));
    require(all_below(points.materials, static_cast<unsigned>(place.rules.material_count)));
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
        require(points.shadows[light].size() == count);
        require(all_below(points.shadows[light],
                          1U << set.shadow_bits[light][static_cast<std::size_t>(place.rules.level)]));
    }
}

void check_plain(const Place &place, const Chunk &chunk) {
    ChunkEntry entry = place.entry;
    const PointView points = view_points(chunk.points, 0, chunk.points.size(), place.rules.set);
    Bytes stored;
    const StreamList streams = streams_of(place.rules.set);
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const Bytes raw = raw_stream(
            {.set = place.rules.set, .stream = streams[s], .level = place.rules.level, .finest = place.rules.finest},
            chunk.masks, points);
        entry.streams[s] = {
            .stored_bytes = static_cast<std::uint32_t>(raw.size()), .filter = Filter::none, .zstd = false};
        stored.insert(stored.end(), raw.begin(), raw.end());
    }
    entry.stored_bytes = stored.size();
    entry.hash = hash64(stored);
    Chunk again;
    require(decode_chunk(entry, stored, place.rules, place.nodes, again).ok());
    require(again.masks == chunk.masks && again.points == chunk.points);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size < 8)
        return 0;
    test::ByteSource input({data, size});
    Place place = choose_place(input);
    ByteView kept = place.original.reader.source().view(chunk_range(place.entry))->bytes;
    if (input.next() % 4 != 0)
        place.entry.cone = {};
    Bytes stored;
    const StreamList streams = streams_of(place.rules.set);
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const std::size_t bytes = place.entry.streams[s].stored_bytes;
        store_stream(place, streams[s], kept.first(bytes), place.entry.streams[s], stored, input);
        kept = kept.subspan(bytes);
    }
    for (unsigned edits = input.next() % 4; edits != 0; --edits)
        stored[input.below(stored.size())] = input.next();
    stored.shrink_to_fit();
    place.entry.stored_bytes = stored.size();
    place.entry.hash = hash64(stored);
    Chunk chunk;
    if (!decode_chunk(place.entry, stored, place.rules, place.nodes, chunk))
        return 0;
    check_values(place, chunk);
    check_plain(place, chunk);
    return 0;
}
