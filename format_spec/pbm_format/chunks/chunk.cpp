#include "pbm_format/chunks/chunk.h"

#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/streams/frame.h"
#include "pbm_format/streams/mask_ranks.h"
#include "pbm_format/streams/predictions.h"
#include "pbm_format/streams/unfilter.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <bit>

namespace pbm {

ParentNodes parent_nodes(const ChunkEntry &entry, ByteView masks, std::uint64_t first_mask,
                         const PointAttributes &points, std::uint64_t first_point, const AttributeSet &set) {
    assert(entry.first_node >= first_point && entry.first_parent >= first_mask);
    return {.masks = slice(masks, entry.first_parent - first_mask, entry.shape.parents),
            .nodes =
                view_points(points, static_cast<std::size_t>(entry.first_node - first_point), entry.shape.nodes, set)};
}

namespace {

// One chunk on its way from the file to `to`.
class Decoder {
  public:
    Decoder(const ChunkEntry &entry, ByteView stored, const ChunkRules &rules, const ParentNodes &parents, Chunk &to)
        : entry_(entry), stored_(stored), rules_(rules), parents_(parents), to_(to), scratch_(scratch()) {}

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
    // Kept by each thread, so that a chunk costs no allocation.
    static UnfilterScratch &scratch() { return per_thread<UnfilterScratch>(); }

    Bytes &bytes_of(const StreamInfo &stream) {
        PointAttributes &points = to_.points;
        switch (stream.kind) {
        case StreamKind::masks: return to_.masks;
        case StreamKind::radius: return points.radii;
        case StreamKind::colour: return points.colours;
        case StreamKind::material: return points.materials;
        case StreamKind::texture: return points.textures;
        case StreamKind::shadow: return points.shadows[stream.light];
        case StreamKind::normal: break; // two bytes each
        }
        assert(false);
        return to_.masks;
    }

    unsigned shadow_bits(const StreamInfo &stream, int level) const {
        return rules_.set.shadow_bits[stream.light][static_cast<std::size_t>(level)];
    }

    bool keeps_lit_bytes() const { return !to_.packs_shadows || !rules_.finest; }

    Status read_plain(ByteView bytes, const StreamInfo &stream, bool zstd) {
        std::vector<std::uint16_t> &normals = to_.points.normals;
        if (stream.kind == StreamKind::normal) {
            if (Status status =
                    decode_frame(bytes, zstd, {reinterpret_cast<std::uint8_t *>(normals.data()), 2 * normals.size()},
                                 offset_, rules_.wording);
                !status)
                return status;
            return check_normals(normals, offset_, rules_.wording);
        }
        if (stream.kind == StreamKind::shadow) {
            Bytes &packed = to_.packs_shadows ? to_.packed_shadows[stream.light] : scratch_.packed;
            return read_lit_fractions(bytes, stream, zstd, packed, to_.points.shadows[stream.light]);
        }
        return decode_frame(bytes, zstd, bytes_of(stream), offset_, rules_.wording);
    }

    // Unpacks into `values` unless that is empty.
    Status read_lit_fractions(ByteView bytes, const StreamInfo &stream, bool zstd, Bytes &packed,
                              std::span<std::uint8_t> values) {
        const unsigned bits = shadow_bits(stream, rules_.level);
        packed.resize((entry_.shape.points * std::size_t{bits} + 7) / 8);
        if (Status status = decode_frame(bytes, zstd, packed, offset_, rules_.wording); !status)
            return status;
        if (Status status = check_packed_tail(packed, entry_.shape.points, bits, offset_, rules_.wording); !status)
            return status;
        unpack_bits(packed, bits, values);
        return {};
    }

    // Plane `index` as `size` bytes with kSlack bytes behind them.
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
        unrank_masks(codes, {.parent_masks = parents_.masks, .node_normals = parents_.nodes.normals}, to_.masks);
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
            unfilter_normals(scratch_, parents_.nodes.normals, codes, escapes, to_.points.normals, outside);
        if (!normals.valid)
            return broken(rules_.wording, "5.8.3", offset_, "an escape lies outside the map of normals");
        cone_is_proven_ = outside != nullptr && !normals.outside;
        return {};
    }

    // For many normals it takes less time to look each up as it is made than to go over them again.
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
        unfilter(scratch_, parents_.nodes.colours, green, red_blue, escapes, to_.points.colours);
        return {};
    }

    // The filters of one plane.
    Status read_values(PlaneCursor &planes, const StreamInfo &stream, Filter filter) {
        ByteView codes;
        PointAttributes &points = to_.points;
        const PointView &nodes = parents_.nodes;
        if (filter == Filter::shadow)
            return read_shadows(planes, stream);
        const std::size_t size = filter == Filter::radius ? entry_.shape.points : scratch_.layout.codes();
        if (Status status = read_plane(planes, 0, size, codes); !status)
            return status;
        if (filter == Filter::radius)
            unfilter_radii(scratch_, nodes.radii, radius_predictions(rules_.level, rules_.finest), codes, points.radii);
        else if (filter == Filter::material)
            unfilter_materials(scratch_, nodes.materials, codes, points.materials);
        else
            unfilter_textures(scratch_, nodes.textures, codes, points.textures);
        return {};
    }

    Status read_shadows(PlaneCursor &planes, const StreamInfo &stream) {
        const unsigned bits = shadow_bits(stream, rules_.level);
        Bytes &codes = scratch_.planes[1];
        codes.resize(std::max(codes.size(), entry_.shape.points + kSlack));
        ByteView stored;
        bool zstd = false;
        const std::size_t size = (std::size_t{entry_.shape.points} * bits + 7) / 8;
        if (!planes.next(size, stored, zstd))
            return impossible_planes(offset_, rules_.wording);
        if (Status status =
                read_lit_fractions(stored, stream, zstd, scratch_.packed, std::span(codes).first(entry_.shape.points));
            !status)
            return status;
        Bytes &values = keeps_lit_bytes() ? to_.points.shadows[stream.light] : scratch_.planes[2];
        values.resize(std::max(values.size(), std::size_t{entry_.shape.points}));
        const std::span<std::uint8_t> points = std::span(values).first(entry_.shape.points);
        unfilter_shadows(scratch_, parents_.nodes.shadows[stream.light],
                         shadow_predictions(shadow_bits(stream, rules_.level - 1), bits), bits,
                         ByteView(codes).first(entry_.shape.points), points);
        if (to_.packs_shadows)
            to_.packed_shadows[stream.light] = pack_bits(points, bits);
        return {};
    }

    // Masks first: they say where the points of the other streams have their parents.
    Status prove(const StreamInfo &stream) {
        switch (stream.kind) {
        case StreamKind::masks: return prove_masks();
        case StreamKind::normal:
            return cone_is_proven_
                       ? Status()
                       : check_cone(to_.points.normals, entry_.cone, scratch_.outside, offset_, rules_.wording);
        case StreamKind::radius: return check_radii(to_.points.radii, rules_.finest, offset_, rules_.wording);
        case StreamKind::material:
            return check_materials(to_.points.materials, rules_.material_count, offset_, rules_.wording);
        case StreamKind::colour:
        case StreamKind::texture:
        case StreamKind::shadow: return {};
        }
        return {};
    }

    Status prove_masks() {
        const MaskSummary summary = summarise_masks(to_.masks);
        if (Status status = check_masks(summary, entry_.shape.points, entry_.offset, rules_.wording); !status)
            return status;
        scratch_.layout.build(to_.masks, summary);
        return {};
    }

    const ChunkEntry &entry_;
    ByteView stored_;
    const ChunkRules &rules_;
    const ParentNodes &parents_;
    Chunk &to_;
    UnfilterScratch &scratch_;
    std::size_t at_ = 0;
    std::uint64_t offset_ = 0; // of the stream in the file
    bool cone_is_proven_ = false;
};

} // namespace

Status decode_chunk(const ChunkEntry &entry, ByteView stored, const ChunkRules &rules, const ParentNodes &parents,
                    Chunk &to) {
    assert(stored.size() == entry.stored_bytes);
    if (const std::uint64_t hash = hash64(stored); hash != entry.hash)
        return broken(rules.wording, "5.6.4", entry.offset, "the chunk was changed: its hash does not match",
                      hash_value(entry.hash), hash_value(hash));
    return Decoder(entry, stored, rules, parents, to).run();
}

void place_chunk(const Chunk &chunk, const ChunkEntry &entry, const AttributeSet &set, Level &level) {
    const auto copy = [](const auto &source, auto &target, std::uint64_t at) {
        std::copy(source.begin(), source.end(), target.begin() + static_cast<std::ptrdiff_t>(at));
    };
    const std::uint64_t first = entry.first_point;
    copy(chunk.masks, level.masks, entry.first_node);
    copy(chunk.points.normals, level.points.normals, first);
    copy(chunk.points.radii, level.points.radii, first);
    copy(chunk.points.colours, level.points.colours, first * static_cast<std::uint64_t>(set.colour_bytes()));
    copy(chunk.points.materials, level.points.materials, set.material ? first : 0);
    copy(chunk.points.textures, level.points.textures, set.texture ? first : 0);
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
        copy(chunk.points.shadows[light], level.points.shadows[light], first);
}

} // namespace pbm
