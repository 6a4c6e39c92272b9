// A hash of what a file shows: equal for every codec, compression level and storage profile. BVG.md 8
#pragma once

#include "pbm_format/hashes/hash.h"
#include "pbm_format/model/model.h"

#include <span>
#include <vector>

namespace pbm {

using ContentId = Hash128;

// Hashes parameters, chunk roots, masks of every level, attributes of the finest level, and level 0 of rasters; the
// rest follows from these. `chunks` is split_into_chunks() of the model's octree.
ContentId content_id(const Model &model, std::span<const std::vector<ChunkShape>> chunks, std::uint32_t chunk_points);

} // namespace pbm
