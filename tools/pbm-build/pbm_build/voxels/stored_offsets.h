// Chooses the points whose surface offsets a file stores. BVG.md 19.6 and 19.7
#pragma once

#include "pbm_build/voxels/voxelize.h"

namespace pbm::build {

// The estimate of the renderers (SurfaceOffsets) is wrong if it lies so far in front of the surface or behind it, voxel
// edges: a splat that sticks out of an outline shows more than one that lies too deep.
inline constexpr double kTooHigh = 0.1, kTooDeep = 0.2;

// The offsets of those voxels where it is wrong and that hold one surface; none if there are hardly any. `voxels` have
// offsets and all of their normals. The chunks are those of a file with kDefaultChunkPoints. The same for any number of
// threads.
Offsets choose_offsets(const Voxels &voxels, int depth, int threads);

} // namespace pbm::build
