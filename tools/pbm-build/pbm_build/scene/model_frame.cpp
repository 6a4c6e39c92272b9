#include "pbm_build/scene/model_frame.h"

#include "pbm_format/model/octree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm::build {
namespace {

using Vector = std::array<double, 3>;

// The axes of pbm_render/camera.h, which this floor does not know: the front is +Z for Y up, -Y for Z up, +Z for X up.
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
    frame.origin = grid.origin;
    set_axes(grid.up, frame);
    std::array<std::uint32_t, 3> low{};
    low.fill(std::numeric_limits<std::uint32_t>::max());
    std::array<std::uint32_t, 3> high{};
    for (const MortonCode code : codes) {
        const auto voxel = morton_decode(code);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], voxel[axis]);
            high[axis] = std::max(high[axis], voxel[axis]);
        }
    }
    // In half voxels, so that all is exact: the farthest corner of any voxel from the centre of the box.
    std::uint64_t farthest = 0;
    for (const MortonCode code : codes) {
        const auto voxel = morton_decode(code);
        std::uint64_t squared = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t from = 2 * std::int64_t{voxel[axis]} - low[axis] - high[axis]; // centre to centre
            const std::uint64_t reach = static_cast<std::uint64_t>(std::abs(from)) + 1;
            squared += reach * reach;
        }
        farthest = std::max(farthest, squared);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
        frame.centre[axis] =
            (static_cast<double>(low[axis]) + static_cast<double>(high[axis]) + 1) / 2 * grid.voxel_size;
    frame.radius = std::sqrt(static_cast<double>(farthest)) / 2 * grid.voxel_size;
    frame.lowest = static_cast<double>(low[frame.up_axis]) * grid.voxel_size;
    return frame;
}

} // namespace pbm::build
