#include "pbm_format/chunks/chunk.h"

#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/streams/frame.h"
#include "pbm_format/streams/mask_ranks.h"
#include "pbm_format/streams/predictions.h"
#include "pbm_format/streams/unfilter.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <bit>

namespace pbm {

ChunkNodes chunk_nodes(const ChunkEntry &entry, ByteView masks, std::uint64_t first_mask, const PointAttributes &points,
                       std::uint64_t first_point, const AttributeSet &set) {
    assert(entry.first_node >= first_point && entry.first_parent >= first_mask);
    return {.parent_masks = slice(masks, entry.first_parent - first_mask, entry.shape.parents),
            .attributes =
                view_points(points, static_cast<std::size_t>(entry.first_node - first_point), entry.shape.nodes, set)};
}

namespace {

class Decoder {
  public:
    Decoder(const ChunkEntry &entry, ByteView stored, const ChunkRules &rules, const ChunkNodes &nodes, Chunk &to)
        : entry_(entry), stored_(stored), rules_(rules), nodes_(nodes), to_(to), scratch_(scratch()) {}

    Status run() {
        to_.masks.resize(entry_.shape.nodes);
        to_.points.resize(entry_.shape.points, rules_.set);
        if (!keeps_lit_bytes())
            to_.points.shadows = {};
        const StreamList streams = streams_of(rules_.set);
        for (std::size_t s = 0; s < streams.size(); ++s) {
            const StreamEntry &stream = entry_.streams[s];
            offset_ = entry_.offset + at_;
            const ByteView bytes = slice(stored_, at_, stream.stored_bytes);
            at_ += stream.stored_bytes;
            if (rules_.leaves_out(streams[s].kind))
                continue;
            Status status = stream.filter == Filter::none ? read_plain(bytes, streams[s], stream.zstd)
                                                          : read_filtered(bytes, streams[s], stream.filter);
            if (status)
                status = prove(streams[s]);
            if (!status)
                return status;
        }
        return {};
    }

  private:
    // Per thread, so that a chunk needs no allocation.
    static UnfilterScratch &scratch() { return per_thread<UnfilterScratch>(); }

    bool keeps_lit_bytes() const { return !to_.packs_shadows || !rules_.finest; }

    Status read_plain(ByteView bytes, const StreamInfo &stream, bool zstd) {
        std::span<std::uint8_t> to =
            stream.kind == StreamKind::masks ? std::span(to_.masks) : bytes_of(to_.points, stream);
        if (stream.kind == StreamKind::shadow) {
            Bytes &packed = to_.packs_shadows ? to_.packed_shadows[stream.light] : scratch_.packed;
            packed.resize(packed_bytes(stream));
            to = packed;
        }
        Status status = decode_frame(bytes, zstd, to, offset_, rules_.wording);
        if (status && stream.kind == StreamKind::normal)
            status = check_normals(to_.points.normals, offset_, rules_.wording);
        if (status && stream.kind == StreamKind::shadow)
            status = unpack(to, stream, to_.points.values(stream));
        return status;
    }

    unsigned bits(const StreamInfo &stream, int level) const { return bits_per_point(stream, rules_.set, level); }
    std::size_t packed_bytes(const StreamInfo &stream) const {
        return static_cast<std::size_t>(raw_stream_bytes(stream, rules_.set, rules_.level, 0, entry_.shape.points));
    }
    // Unpacks lit fractions; `values` may be empty.
    Status unpack(ByteView packed, const StreamInfo &stream, std::span<std::uint8_t> values) const {
        const unsigned width = bits(stream, rules_.level);
        Status status = check_packed_tail(packed, entry_.shape.points, width, offset_, rules_.wording);
        if (status)
            unpack_bits(packed, width, values);
        return status;
    }

    // Reads plane `index`: `size` bytes, padded by kSlack bytes.
    Status read_plane(PlaneCursor &planes, std::size_t index, std::size_t size, ByteView &plane) {
        Bytes &memory = scratch_.planes[index];
        memory.resize(std::max(memory.size(), size + kSlack));
        ByteView stored;
        bool zstd = false;
        if (!planes.next(size, stored, zstd))
            return impossible_planes(offset_, rules_.wording);
        plane = ByteView(memory).first(size);
        return decode_frame(stored, zstd, std::span(memory).first(size), offset_, rules_.wording);
    }

    Status read_escapes(PlaneCursor &planes, std::size_t index, ByteView pairs, ByteView &escapes) {
        const EscapeCount count = count_escapes(pairs);
        if (!count.valid)
            return broken(rules_.wording, "5.8.2", offset_, "a code of a pair is no escape and no pair");
        return read_plane(planes, index, 2 * count.count, escapes);
    }

    Status read_filtered(ByteView bytes, const StreamInfo &stream, Filter filter) {
        PlaneCursor planes(bytes, plane_count(filter));
        Status status = filter == Filter::mask_rank ? read_ranks(planes)
                        : filter == Filter::normal  ? read_normals(planes)
                        : filter == Filter::colour565 || filter == Filter::colour888
                            ? read_colours(planes, filter)
                            : read_values(planes, stream, filter);
        if (status && !planes.finished())
            return impossible_planes(offset_, rules_.wording);
        return status;
    }

    Status read_ranks(PlaneCursor &planes) {
        ByteView codes;
        if (Status status = read_plane(planes, 0, entry_.shape.nodes, codes); !status)
            return status;
        unrank_masks(codes, {.parent_masks = nodes_.parent_masks, .node_normals = nodes_.attributes.normals},
                     to_.masks);
        return {};
    }

    Status read_normals(PlaneCursor &planes) {
        ByteView codes, escapes;
        if (Status status = read_plane(planes, 0, scratch_.layout.codes(), codes); !status)
            return status;
        if (Status status = read_escapes(planes, 1, codes, escapes); !status)
            return status;
        const OutsideCone *outside = outside_cone();
        const UnfilteredNormals normals =
            unfilter_normals(scratch_, nodes_.attributes.normals, codes, escapes, to_.points.normals, outside);
        if (!normals.valid)
            return broken(rules_.wording, "5.8.3", offset_, "an escape lies outside the map of normals");
        cone_is_verified_ = outside != nullptr && !normals.outside;
        return {};
    }

    // Marks the normals outside of the cone. For many normals a lookup while decoding is faster than a second pass.
    const OutsideCone *outside_cone() {
        if (entry_.cone.cosine == kNoCone || entry_.shape.points < kManyNormals)
            return nullptr;
        mark_outside(entry_.cone, scratch_.outside);
        return &scratch_.outside;
    }

    Status read_colours(PlaneCursor &planes, Filter filter) {
        ByteView green, red_blue, escapes;
        if (Status status = read_plane(planes, 0, scratch_.layout.codes(), green); !status)
            return status;
        if (Status status = read_plane(planes, 1, scratch_.layout.codes(), red_blue); !status)
            return status;
        if (Status status = read_escapes(planes, 2, red_blue, escapes); !status)
            return status;
        const auto unfilter = filter == Filter::colour565 ? unfilter_colours_565 : unfilter_colours_888;
        unfilter(scratch_, nodes_.attributes.colours, green, red_blue, escapes, to_.points.colours);
        return {};
    }

    // Reads streams whose filters have one plane.
    Status read_values(PlaneCursor &planes, const StreamInfo &stream, Filter filter) {
        if (filter == Filter::shadow)
            return read_shadows(planes, stream);
        ByteView codes;
        const std::size_t size = filter == Filter::radius ? entry_.shape.points : scratch_.layout.codes();
        if (Status status = read_plane(planes, 0, size, codes); !status)
            return status;
        const ByteView nodes = nodes_.attributes.values(stream);
        Bytes &points = to_.points.values(stream);
        if (filter == Filter::radius)
            unfilter_radii(scratch_, nodes, radius_predictions(rules_.level, rules_.finest), codes, points);
        else if (filter == Filter::material)
            unfilter_materials(scratch_, nodes, codes, points);
        else
            unfilter_textures(scratch_, nodes, codes, points);
        return {};
    }

    Status read_shadows(PlaneCursor &planes, const StreamInfo &stream) {
        ByteView packed;
        if (Status status = read_plane(planes, 0, packed_bytes(stream), packed); !status)
            return status;
        Bytes &memory = scratch_.planes[1];
        memory.resize(std::max(memory.size(), entry_.shape.points + kSlack));
        const std::span<std::uint8_t> codes = std::span(memory).first(entry_.shape.points);
        if (Status status = unpack(packed, stream, codes); !status)
            return status;
        Bytes &values = keeps_lit_bytes() ? to_.points.values(stream) : scratch_.planes[2];
        values.resize(std::max(values.size(), std::size_t{entry_.shape.points}));
        const std::span<std::uint8_t> points = std::span(values).first(entry_.shape.points);
        const unsigned here = bits(stream, rules_.level);
        unfilter_shadows(scratch_, nodes_.attributes.values(stream),
                         shadow_predictions(bits(stream, rules_.level - 1), here), here, codes, points);
        if (to_.packs_shadows)
            to_.packed_shadows[stream.light] = pack_bits(points, here);
        return {};
    }

    // Verifies a stream. Masks come first: they determine the parents of the points in the other streams.
    Status prove(const StreamInfo &stream) {
        if (stream.kind == StreamKind::masks)
            return verify_masks();
        if (stream.kind == StreamKind::normal)
            return cone_is_verified_
                       ? Status()
                       : check_cone(to_.points.normals, entry_.cone, scratch_.outside, offset_, rules_.wording);
        return check_values(stream, to_.points.values(stream), rules_, offset_);
    }

    Status verify_masks() {
        const MaskSummary summary = summarise_masks(to_.masks);
        if (Status status = check_masks(summary, entry_.shape.points, entry_.offset, rules_.wording); !status)
            return status;
        scratch_.layout.build(to_.masks, summary);
        return {};
    }

    const ChunkEntry &entry_;
    ByteView stored_;
    const ChunkRules &rules_;
    const ChunkNodes &nodes_;
    Chunk &to_;
    UnfilterScratch &scratch_;
    std::size_t at_ = 0;
    std::uint64_t offset_ = 0; // of the stream in the file
    bool cone_is_verified_ = false;
};

} // namespace

Status decode_chunk(const ChunkEntry &entry, ByteView stored, const ChunkRules &rules, const ChunkNodes &nodes,
                    Chunk &to) {
    assert(stored.size() == entry.stored_bytes);
    if (const std::uint64_t hash = hash64(stored); hash != entry.hash)
        return broken(rules.wording, "5.6.4", entry.offset, "the chunk was changed: its hash does not match",
                      hash_value(entry.hash), hash_value(hash));
    return Decoder(entry, stored, rules, nodes, to).run();
}

void place_chunk(const Chunk &chunk, const ChunkEntry &entry, const AttributeSet &set, Level &level) {
    const auto copy = [](const auto &source, auto &target, std::uint64_t at) {
        std::copy(source.begin(), source.end(), target.begin() + static_cast<std::ptrdiff_t>(at));
    };
    copy(chunk.masks, level.masks, entry.first_node);
    for_columns(
        set,
        [&](const StreamInfo &, std::size_t width, const auto &source, auto &target) {
            copy(source, target, width * entry.first_point);
        },
        chunk.points, level.points);
}

} // namespace pbm
