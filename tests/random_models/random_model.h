// Random legal models: every choice of the format depends on a seed.
#pragma once

#include "pbm_format/model/model.h"
#include "unit/support/test_models.h"

#include <vector>

namespace pbm::test {

// 1 to about `most` voxel addresses, ascending: single voxels, lines, planes, blocks, clusters, shells, relief, full
// chunks, or several of these.
std::vector<MortonCode> random_voxels(Random &random, int depth, std::size_t most);

// Fills the attributes of `set`: constant, smooth, constant in regions, or noise.
PointAttributes random_points(Random &random, std::span<const MortonCode> codes, int depth, const AttributeSet &set,
                              std::size_t materials);

// A complete model with averaged levels and rasters, and at most about `max_points` points.
Model random_model(Random &random, std::size_t max_points);

// True once in `n` times.
inline bool once_in(Random &random, std::uint64_t n) { return random.below(n) == 0; }

} // namespace pbm::test
