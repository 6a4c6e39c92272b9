// The rasters of a file: panorama, texture of the ground plane, lit fractions of the ground plane. BVG.md 3.10
#pragma once

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/reader.h"

namespace pbm {

// The sections that hold rasters, in the order of the file.
std::vector<const SectionEntry *> rasters(const Reader &reader);
// Headers and tile directories of all rasters: the ranges that `read_images` reads.
std::vector<FileRange> raster_ranges(const Reader &reader);

// Verifies the tile directories of all rasters. A tile is verified when it is first looked at. The images need the
// file's bytes, not the reader. Each call opens them anew.
Result<TiledImages> read_images(const Reader &reader);

} // namespace pbm
