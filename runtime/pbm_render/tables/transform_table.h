// Transforms an octree by additions: image of a child's centre = image of its parent's centre + M*d, one table entry.
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002; dissertation
// section 4.4
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/projection.h"

#include <glm/vec4.hpp>

#include <array>

namespace pbm {

struct TransformTable {
    TransformTable(const Grid &grid, const Projection &projection);

    // Four numbers (u, v, w, 0) each, added by one instruction.
    glm::vec4 centre; // M*c of the whole cube
    // M*d from a node's centre to its child's: [level of the child][child]; index 0 is unused.
    std::array<std::array<glm::vec4, 8>, kMaxDepth + 1> child;
};

} // namespace pbm
