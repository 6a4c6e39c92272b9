// What a point carries besides its place: one stream per attribute. BVG.md section 6.
#pragma once

#include "pbm_format/model/normal.h"
#include "pbm_format/model/octree.h"
#include "system/bytes.h"

#include <array>
#include <cstdint>
#include <vector>

namespace pbm {

inline constexpr int kMaxLights = 8;
inline constexpr int kMaxMaterials = 8;

enum class ColourFormat : std::uint8_t { none = 0, rgb565 = 1, rgb888 = 2 };

using Rgb8 = std::array<std::uint8_t, 3>; // sRGB

// Which attributes the points of a file carry. Normal and radius always.
struct AttributeSet {
    ColourFormat colour = ColourFormat::none;
    bool material = false; // 3-bit index; without it every point has material 0
    bool texture = false;  // 8-bit solid-texture value
    int lights = 0;        // shadow streams, one per light 0..lights-1
    // Bits of lit fraction per light and level: 1, 2, 4 or 8; index 0 is the root. Unused lights hold zeros.
    std::array<std::array<std::uint8_t, kMaxDepth + 1>, kMaxLights> shadow_bits{};

    int colour_bytes() const { return colour == ColourFormat::none ? 0 : colour == ColourFormat::rgb565 ? 2 : 3; }
    bool operator==(const AttributeSet &) const = default;
};

// Streams of an AttributeSet in the order in which a chunk stores them.
enum class StreamKind : std::uint8_t {
    masks = 0,
    normal = 1,
    radius = 2,
    colour = 3,
    material = 4,
    texture = 5,
    shadow = 6
};
std::string_view to_string(StreamKind kind);

struct StreamInfo {
    StreamKind kind{};
    std::uint8_t light = 0; // shadow streams only
};
// Each chunk asks for them, so they take no memory from the heap.
class StreamList {
  public:
    void add(StreamKind kind, std::uint8_t light = 0) { all_[size_++] = {kind, light}; }

    std::size_t size() const { return size_; }
    const StreamInfo &operator[](std::size_t i) const { return all_[i]; }
    const StreamInfo *begin() const { return all_.data(); }
    const StreamInfo *end() const { return all_.data() + size_; }

  private:
    std::array<StreamInfo, 6 + kMaxLights> all_{};
    std::size_t size_ = 0;
};
StreamList streams_of(const AttributeSet &set);

// Bytes of one unfiltered stream of a chunk or level. Shadow values are packed, lowest bits first.
std::uint64_t raw_stream_bytes(const StreamInfo &stream, const AttributeSet &set, int level, std::uint64_t nodes,
                               std::uint64_t points);

// Lit fractions of `bits` bits each, lowest bits first, and back. BVG.md 6.6
Bytes pack_bits(ByteView values, unsigned bits);
void unpack_bits(ByteView packed, unsigned bits, std::span<std::uint8_t> values);

// Attributes of the points of one chunk or one level, in Morton order. Streams that the AttributeSet lacks are empty.
struct PointAttributes {
    std::vector<std::uint16_t> normals; // normal index | kTwoSidedBit
    Bytes radii;                        // index into the radius table
    Bytes colours;                      // [points][colour_bytes], 565 little-endian (red high) or R G B
    Bytes materials;
    Bytes textures;
    std::array<Bytes, kMaxLights> shadows; // one byte per point here: lit fraction x (2^bits - 1), 0 = in shadow

    std::size_t size() const { return normals.size(); }
    void resize(std::size_t points, const AttributeSet &set);
    bool operator==(const PointAttributes &) const = default;
};

Rgb8 expand_565(std::uint16_t colour);
std::uint16_t pack_565(Rgb8 colour); // nearest
// Colour of point `i` of a colour stream, expanded to 8 bits per channel by repeating the high bits; black without.
inline Rgb8 point_colour(const std::uint8_t *colours, std::size_t i, ColourFormat format) {
    if (format == ColourFormat::rgb888)
        return {colours[3 * i], colours[3 * i + 1], colours[3 * i + 2]};
    if (format == ColourFormat::rgb565)
        return expand_565(static_cast<std::uint16_t>(colours[2 * i] | colours[2 * i + 1] << 8));
    return {};
}
inline Rgb8 point_colour(ByteView colours, std::size_t i, ColourFormat format) {
    return point_colour(colours.data(), i, format);
}
void set_point_colour(PointAttributes &points, std::size_t i, ColourFormat format, Rgb8 colour);

// sRGB to linear light, 16 bits: [256], ascending from 0 to 65,535. Normative: BVG.md table 6.3.
std::span<const std::uint16_t> linear_table();
// The sRGB value whose linear value is nearest; ties go to the lower one.
std::uint8_t linear_to_srgb(std::uint32_t linear);

// Radius of an index in units of 2^-40 of the grid's edge: edge x 2^((i - 255) / 12), rounded down. BVG.md table 6.2.
std::uint64_t radius_fixed(std::uint8_t index);
// The same as a fraction of the grid's edge.
double radius_fraction(std::uint8_t index);
// Smallest index whose radius is at least `fraction` of the grid's edge (255 if none is).
std::uint8_t radius_index(double fraction);
// Smallest index that covers children of radius `child_index` from the centre of a node of `level` (6.2.3):
// radius >= child's radius + sqrt(3)/4 of the node's edge.
std::uint8_t covering_radius(std::uint8_t child_index, int level);
// At the finest level a radius is at most 5 % of the grid's edge.
inline constexpr std::uint8_t kMaxFinestRadius = 203;

} // namespace pbm
