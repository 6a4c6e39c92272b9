// Filters: the streams of a chunk as differences to the nodes of the level above, which are decoded before.
// BVG.md section 5.8.
//
//   level L - 1   node j:  normal, radius, colour ..       known
//   level L       masks    how many children node j has    decoded first
//                 points   differences to node j, one code per point; none for only children, which equal their parent
//
// A filter turns a stream into planes of bytes, each coded as a frame of its own: codes first, at last the escapes of
// what a code cannot say. Points do not depend on their siblings, so un-filtering runs over 16 points at once.
#pragma once

#include "pbm_format/point_attributes.h"

#include <optional>
#include <vector>

namespace pbm {

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
    texels = 9 // of tiles of rasters: texel_filter.h
};

// The one filter that a stream of a chunk may have besides none.
Filter filter_of(const StreamInfo &stream, const AttributeSet &set);
// Planes of a stream of a chunk with that filter: 1 to 3, 0 for none. Those of tiles have one for each channel.
std::size_t plane_count(Filter filter);
inline constexpr std::size_t kMaxPlanes = 3;

// Streams of a range of points where they lie. Those that the AttributeSet lacks are empty.
struct PointView {
    std::span<const std::uint16_t> normals;
    ByteView radii, colours, materials, textures;
    std::array<ByteView, kMaxLights> shadows;
};
PointView view_points(const PointAttributes &points, std::size_t first, std::size_t count, const AttributeSet &set);

// The nodes of level L - 1 below a chunk's root, whose children are the chunk's points.
struct ParentNodes {
    ByteView masks;  // of level L - 1, one per node of level L - 2, whose children these nodes are; empty for L = 1
    PointView nodes; // one per mask of the chunk
};

// What there is to know about a stream besides its points.
struct StreamContext {
    const AttributeSet &set;
    StreamInfo stream;
    int level;
    bool finest; // level is the depth
};

// Planes of the stream of `points` with filter_of(stream); nothing if the filter cannot say them: an only child
// differs from its parent. `masks` are the chunk's.
std::optional<std::vector<Bytes>> filter_stream(const StreamContext &context, ByteView masks, const PointView &points,
                                                const ParentNodes &parents);

// Index of the largest radius that a child at `level` can have below a node of radius index `parent`. BVG.md 5.8.4
const std::array<std::uint8_t, 256> &radius_predictions(int level, bool finest);

// Lit fraction of `parent_bits` bits on the scale of `bits` bits. BVG.md 5.8.8
std::array<std::uint8_t, 256> shadow_predictions(unsigned parent_bits, unsigned bits);

} // namespace pbm
