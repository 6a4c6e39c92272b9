// A hash of what a file shows: equal for every codec, compression level and storage profile. BVG.md 8
#pragma once

#include "pbm_format/container/layout.h"

#include <functional>
#include <span>
#include <vector>

namespace pbm {

// Hashes parameters, chunk roots, masks of every level, attributes of the finest level, and level 0 of rasters; the
// rest follows from these. `chunks` is split_into_chunks() of the model's octree.
ContentId content_id(const Model &model, std::span<const std::vector<ChunkShape>> chunks, std::uint32_t chunk_points);

// The text that content_id hashes, in pieces, in its order, up to the rasters. BVG.md 8.1
struct ContentPieces {
    std::function<void(ByteView)> bytes;            // these bytes
    std::function<void(std::size_t level)> masks;   // all masks of the level
    std::function<void(const StreamInfo &)> stream; // of the finest level: 0 bytes if the model lacks it
};
void visit_content(const ModelParameters &parameters, std::span<const std::vector<ChunkShape>> chunks,
                   std::uint32_t chunk_points, const ContentPieces &pieces);
// What stands in front of the texels of a raster.
Bytes content_of_raster(SectionType type, std::uint32_t instance, std::uint32_t width, std::uint32_t height);

} // namespace pbm
