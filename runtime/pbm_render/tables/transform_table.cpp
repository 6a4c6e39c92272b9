#include "pbm_render/tables/transform_table.h"

#include <cmath>

namespace pbm {

TransformTable::TransformTable(const Grid &grid, const Projection &projection) : child{} {
    const glm::dvec3 origin(grid.origin[0], grid.origin[1], grid.origin[2]);
    centre = glm::vec4(projection.point(origin + grid.edge() / 2), 0);
    for (int level = 1; level <= kMaxDepth; ++level) {
        const double d = std::ldexp(grid.edge(), -level - 1);
        for (std::size_t i = 0; i < 8; ++i)
            child[static_cast<std::size_t>(level)][i] =
                glm::vec4(projection.vector({i & 1 ? d : -d, i & 2 ? d : -d, i & 4 ? d : -d}), 0);
    }
}

} // namespace pbm
