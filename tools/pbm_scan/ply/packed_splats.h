// Gaussian splats of a PLY file in packed integers, as PlayCanvas and SuperSplat write them (.compressed.ply).
#pragma once

#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Whether the file has an element `chunk`, and vertices of the property `packed_position`.
bool are_packed_splats(const PlyHeader &header);

// Element `chunk` has the bounds of 256 splats: floats min_x .. max_z of centres, min_scale_x .. max_scale_z of
// logarithms of scales, and min_r .. max_b of colours, which are 0 and 1 in older files. Element `vertex` has
// fractions between these bounds: 11, 10 and 11 bits of packed_position and packed_scale, 8 bits of the colours in
// packed_color, whose last byte is the opacity. packed_rotation has the number of the largest of w x y z in 2 bits, and
// the three others in 10 bits each, in units of -sqrt(1/2) .. sqrt(1/2).
//
// errors  bad_input            cut short, other properties, fewer chunks than the splats need, all splats faint
//         unsupported_feature  text, or big-endian
Result<Surface> read_packed_splats(std::span<const std::uint8_t> bytes, const PlyHeader &header,
                                   const ReadOptions &options);

} // namespace pbm::build
