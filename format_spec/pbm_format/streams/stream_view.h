// What a filter knows of a stream besides its points: the parent nodes that it refers to, and where it belongs.
#pragma once

#include "pbm_format/model/streams.h"

namespace pbm {

// The nodes of level L - 1 below a chunk's root, whose children are the chunk's points.
struct ParentNodes {
    ByteView masks;  // of level L - 1, one per node of level L - 2, whose children these nodes are; empty for L = 1
    PointView nodes; // one per mask of the chunk
};

struct StreamContext {
    const AttributeSet &set;
    StreamInfo stream;
    int level;
    bool finest; // level is the depth
};

} // namespace pbm
