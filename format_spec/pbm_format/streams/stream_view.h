// The streams of a chunk where they lie, and those of its parent nodes, which are what its filters refer to.
#pragma once

#include "pbm_format/model/filter.h"

#include <array>
#include <span>

namespace pbm {

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

} // namespace pbm
