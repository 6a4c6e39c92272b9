// THE TABLE OF STREAMS: the attributes of a point besides its position, one stream each, described once. Code that
// treats all streams alike (filters, averages, hashes, copies, counts, texts) loops over it. BVG.md 6
//
// A new attribute of points, step by step. docs/how-to/add-an-attribute.md shows the code of each step.
//
//   1 this file                a StreamKind, a flag of AttributeSet, a column of PointColumns and its case in `column`,
//                              a row of kStreams, a byte of RootRecord
//   2 pbm_format/container/    that byte of the header: layout.cpp reads it, section_encoder.cpp writes it
//     pbm_format/chunks/       stream_rules.cpp, check_values: only if some bytes are no value
//   3 pbm_scan/surface/        surface.h: an array of vertices, and a row of kByteAttributes with its PLY property
//   4 pbm_build/voxels/        sample.h, sample_points.cpp, voxel_sums.h: from vertices to samples to the voxel
//     pbm_build/upsampling/    upsample.cpp: the value of made points
//     pbm_build/mesh_repair/   fill_holes.cpp: the value of made vertices
//     pbm_build/pipeline.cpp   choose_attributes sets the flag
//   5 pbm_render/appearance/   appearance.cpp: what the value looks like
//   6 bindings/                pbm.h, c/model.cpp and c/points.cpp; python/pbm/model.py and _library.py; web/module/
//   7 the format               BVG.md, tests/second_decoder/, format_spec/vectors/, in the same commit
//   8 tests                    unit/support/test_models.h, random_models/random_model.cpp, unit/format/filters_test.cpp
// Stability: stable.
#pragma once

#include "pbm_format/model/normal.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/model/point_values.h"
#include "system/bytes.h"

#include <array>
#include <cassert>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

inline constexpr int kMaxLights = 8;
inline constexpr int kMaxMaterials = 8;

// The attributes of a file's points. Normal and radius always exist.
struct AttributeSet {
    ColourFormat colour = ColourFormat::none;
    bool material = false; // 3-bit index; without it, all points have material 0
    bool texture = false;  // 8-bit solid-texture value
    int lights = 0;        // shadow streams, one per light 0..lights-1
    // Bits of lit fraction per light and level: 1, 2, 4 or 8; index 0 is the root. Zero for unused lights.
    std::array<std::array<std::uint8_t, kMaxDepth + 1>, kMaxLights> shadow_bits{};

    int colour_bytes() const { return colour == ColourFormat::none ? 0 : colour == ColourFormat::rgb565 ? 2 : 3; }
    bool operator==(const AttributeSet &) const = default;
};

// Numbers of attributes in a file, BVG.md 3.5; masks are not an attribute of points.
enum class StreamKind : std::uint8_t {
    masks = 0,
    normal = 1,
    radius = 2,
    colour = 3,
    material = 4,
    texture = 5,
    shadow = 6
};

struct StreamInfo {
    StreamKind kind{};
    std::uint8_t light = 0; // shadow streams only
};

// How a chunk may store the bytes of a stream. BVG.md 5.4.1 and 5.8
enum class Filter : std::uint8_t {
    none = 0,
    mask_rank = 1,
    normal = 2,
    radius = 3,
    colour565 = 4,
    colour888 = 5,
    material = 6,
    texture = 7,
    shadow = 8,
    texels = 9,  // for tiles of rasters: texel_filter.h
    field16 = 10 // for fields of two bytes: field_chunk.h
};

// How a coarser point gets its value from the points below it: the normal of their sum or plane, the smallest covering
// radius, the mean in linear light, the most frequent value, or the mean. BVG.md 7
enum class Average : std::uint8_t { none, normal, covering, linear_light, vote, mean };

struct StreamTraits {
    StreamKind kind;
    std::string_view name;       // of the stream, for tables
    std::string_view value_name; // of one value, for messages
    Filter filter;               // the only one besides none; 24-bit colours have the next one
    Average average;
    std::uint8_t root_at = 0;           // offset of its value in the header's root record
    bool AttributeSet::*flag = nullptr; // set if a file has the stream; null if mandatory, or if there are formats
    std::string_view ply_property = {}; // property of exported points that takes the value; empty: none
};

// In the order of storage in a chunk.
inline constexpr std::array kStreams{
    StreamTraits{StreamKind::masks, "masks", "mask", Filter::mask_rank, Average::none},
    StreamTraits{StreamKind::normal, "normal", "normal", Filter::normal, Average::normal, 0},
    StreamTraits{StreamKind::radius, "radius", "radius", Filter::radius, Average::covering, 6},
    StreamTraits{StreamKind::colour, "colour", "colour", Filter::colour565, Average::linear_light, 2},
    StreamTraits{StreamKind::material, "material", "material", Filter::material, Average::vote, 5,
                 &AttributeSet::material, "material_index"},
    StreamTraits{StreamKind::texture, "texture", "texture value", Filter::texture, Average::mean, 7,
                 &AttributeSet::texture},
    StreamTraits{StreamKind::shadow, "shadow", "lit fraction", Filter::shadow, Average::mean, 8},
};

// Values of points in Morton order: one column per stream, empty if the AttributeSet lacks it. Normals are 16-bit
// numbers; all others are bytes.
template <class Normals, class Values> struct PointColumns {
    Normals normals;  // normal index | kTwoSidedBit
    Values radii;     // index into the radius table
    Values colours;   // [points][colour_bytes], 565 little-endian (red high) or R G B
    Values materials; // index
    Values textures;
    std::array<Values, kMaxLights> shadows; // lit fraction x (2^bits - 1), 0 = in shadow; one byte per point

    // The column of a stream other than normals. `column` does not accept shadow streams either.
    Values &values(const StreamInfo &stream) {
        return stream.kind == StreamKind::shadow ? shadows[stream.light] : this->*column(stream.kind);
    }
    const Values &values(const StreamInfo &stream) const { return const_cast<PointColumns &>(*this).values(stream); }
    static constexpr Values PointColumns::*column(StreamKind kind) {
        switch (kind) {
        case StreamKind::radius: return &PointColumns::radii;
        case StreamKind::colour: return &PointColumns::colours;
        case StreamKind::material: return &PointColumns::materials;
        case StreamKind::texture: return &PointColumns::textures;
        case StreamKind::masks:
        case StreamKind::normal:
        case StreamKind::shadow: break;
        }
        assert(false);
        return nullptr;
    }
    bool operator==(const PointColumns &) const = default;
};

using PointView = PointColumns<std::span<const std::uint16_t>, ByteView>;

// Values of the points of one chunk or one level.
struct PointAttributes : PointColumns<std::vector<std::uint16_t>, Bytes> {
    std::size_t size() const { return normals.size(); }
    void resize(std::size_t points, const AttributeSet &set);
    void append(const PointAttributes &more, const AttributeSet &set);
    bool operator==(const PointAttributes &) const = default;
};

inline constexpr std::size_t kMaxStreams = kStreams.size() - 1 + kMaxLights;

// A list without heap memory: it is made for every chunk.
class StreamList {
  public:
    constexpr void add(StreamKind kind, std::uint8_t light = 0) { all_[size_++] = {kind, light}; }

    std::size_t size() const { return size_; }
    const StreamInfo &operator[](std::size_t i) const { return all_[i]; }
    const StreamInfo *begin() const { return all_.data(); }
    const StreamInfo *end() const { return all_.data() + size_; }

  private:
    std::array<StreamInfo, kMaxStreams> all_{};
    std::size_t size_ = 0;
};

// Streams of an AttributeSet in the order of storage, masks first.
StreamList streams_of(const AttributeSet &set);
// All streams that points can have.
const StreamList &point_streams();

const StreamTraits &traits_of(StreamKind kind);
inline std::string_view to_string(StreamKind kind) { return traits_of(kind).name; }
// "shadow 2"; other streams have the name of their kind.
std::string name_of(const StreamInfo &stream);

// The filter that a chunk's stream may have besides none.
Filter filter_of(const StreamInfo &stream, const AttributeSet &set);
// Number of planes of a chunk's stream with this filter: 1 to 3; 0 for none. (Tiles have one per channel.)
std::size_t plane_count(Filter filter);

// Bytes of one point in the stream's column; 0 for masks and for streams that the set lacks.
std::size_t bytes_per_point(const StreamInfo &stream, const AttributeSet &set);
// Bits of one point in the unfiltered stream of a level; lit fractions are packed there.
unsigned bits_per_point(const StreamInfo &stream, const AttributeSet &set, int level);
// Bytes of one unfiltered stream of a chunk or level.
std::uint64_t raw_stream_bytes(const StreamInfo &stream, const AttributeSet &set, int level, std::uint64_t nodes,
                               std::uint64_t points);

// Calls `visit(stream, width, its columns ..)` for every stream that points can have; a point has `width` entries in a
// column, none if the set lacks the stream.
template <class Visit, class... Columns> void for_columns(const AttributeSet &set, Visit &&visit, Columns &...points) {
    for (const StreamInfo &stream : point_streams())
        if (stream.kind == StreamKind::normal)
            visit(stream, std::size_t{1}, points.normals...);
        else
            visit(stream, bytes_per_point(stream, set), points.values(stream)...);
}

// Views a range of points.
PointView view_points(const PointAttributes &points, std::size_t first, std::size_t count, const AttributeSet &set);
// The bytes of any stream, normals included.
std::span<std::uint8_t> bytes_of(PointAttributes &points, const StreamInfo &stream);
ByteView bytes_of(const PointView &points, const StreamInfo &stream);

// The nodes of a chunk of level L, and the masks of the chunk's parents. BVG.md 5.3 and 5.5.13
struct ChunkNodes {
    ByteView parent_masks; // [parents] of level L - 1, one per node of level L - 2; empty for L = 1
    PointView attributes;  // [nodes] of level L - 1, one per mask of the chunk: the parents of its points
};

// A stream and its place in the file.
struct StreamContext {
    const AttributeSet &set;
    StreamInfo stream;
    int level;
    bool finest; // level is the depth
};

// Packs lit fractions of `bits` bits each, lowest bits first, and unpacks them. BVG.md 6.6
Bytes pack_bits(ByteView values, unsigned bits);
void unpack_bits(ByteView packed, unsigned bits, std::span<std::uint8_t> values);

void set_point_colour(PointAttributes &points, std::size_t i, ColourFormat format, Rgb8 colour);

// The root, the whole model as one point, as stored in the header; kStreams has the offsets of the values.
struct RootRecord {
    std::array<std::uint8_t, 16> bytes{};

    std::uint16_t normal() const { return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8); }
    Rgb8 colour() const { return {bytes[2], bytes[3], bytes[4]}; } // 24 bits in every file
    std::uint8_t value(const StreamInfo &stream) const { return bytes[traits_of(stream.kind).root_at + stream.light]; }
    bool operator==(const RootRecord &) const = default;
};
// Converts the root record to a level of one point, and back.
PointAttributes root_points(const RootRecord &root, const AttributeSet &set);
RootRecord root_record(const PointAttributes &points, const AttributeSet &set);

} // namespace pbm
