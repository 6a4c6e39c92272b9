#include "pbm_build/scene/model_frame.h"

#include "pbm_build/lattice/lattice.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

glm::ivec3 voxel_at(MortonCode code) {
    const auto at = morton_decode(code);
    return {at[0], at[1], at[2]};
}

// The axes of pbm_render/camera.h, which this floor may not include: the front is +Z for Y up, -Y for Z up, +Z for X
// up.
void set_axes(UpAxis up, ModelFrame &frame) {
    switch (up) {
    case UpAxis::y: frame.right = {1, 0, 0}, frame.up = {0, 1, 0}, frame.front = {0, 0, 1}, frame.up_axis = 1; return;
    case UpAxis::z: frame.right = {1, 0, 0}, frame.up = {0, 0, 1}, frame.front = {0, -1, 0}, frame.up_axis = 2; return;
    case UpAxis::x: frame.right = {0, -1, 0}, frame.up = {1, 0, 0}, frame.front = {0, 0, 1}, frame.up_axis = 0; return;
    }
}

} // namespace

ModelFrame frame_of(const Grid &grid, std::span<const MortonCode> codes) {
    ModelFrame frame;
    frame.origin = vector_of(grid.origin);
    set_axes(grid.up, frame);
    glm::ivec3 low = voxel_at(codes.front()), high = low;
    for (const MortonCode code : codes) {
        low = glm::min(low, voxel_at(code));
        high = glm::max(high, voxel_at(code));
    }
    // The farthest corner of any voxel from the centre of the box, in half voxels, which is exact.
    std::int64_t farthest = 0;
    for (const MortonCode code : codes) {
        const glm::i64vec3 reach = glm::abs(2 * voxel_at(code) - low - high) + 1; // centre to centre, and to the corner
        farthest = std::max(farthest, reach.x * reach.x + reach.y * reach.y + reach.z * reach.z);
    }
    frame.centre = glm::dvec3(low + high + 1) / 2.0 * grid.voxel_size;
    frame.radius = std::sqrt(static_cast<double>(farthest)) / 2 * grid.voxel_size;
    frame.lowest = static_cast<double>(low[frame.up_axis]) * grid.voxel_size;
    return frame;
}

} // namespace pbm::build
