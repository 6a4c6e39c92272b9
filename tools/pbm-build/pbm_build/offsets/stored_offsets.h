// Chooses the points whose surface offsets a file stores. BVG.md 19.6 and 19.7
#pragma once

#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/writing/writer.h"

namespace pbm::build {

// An estimate of the renderers (SurfaceOffsets) is wrong if it lies so far in front of the surface or behind it, voxel
// edges: a splat that sticks out of an outline shows more than one that lies too deep.
inline constexpr double kTooHigh = 0.1, kTooDeep = 0.2;

// The offsets of voxels that hold one surface, and whose estimate is wrong.
struct WrongEstimates {
    Offsets offsets;
    std::vector<float> wrongness; // [offsets] error of the estimate over the limit: 1 or more
};
// `voxels` have offsets and all of their normals. The chunks are those of a file with kDefaultChunkPoints. The same for
// any number of threads.
WrongEstimates find_wrong_estimates(const Voxels &voxels, int depth, int threads);

// The worst of them that a file has room for; none if hardly any are wrong. `model`: without offsets. `most_bytes`: of
// its file, as estimated from one chunk in eight.
Offsets choose_offsets(const WrongEstimates &wrong, const Model &model, double most_bytes, const WriteOptions &options);

} // namespace pbm::build
