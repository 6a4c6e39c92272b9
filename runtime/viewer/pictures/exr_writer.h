// OpenEXR pictures, for programs that compose pictures. The only user of OpenEXR, whose library is loaded with the
// first of them.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

#include <array>
#include <cstdint>
#include <vector>

namespace pbm {

// The point that a pixel shows, as integers.
struct PointNumbers {
    std::uint32_t level = 0;    // of detail
    std::uint32_t material = 0; // index
    std::uint32_t point = 0;    // of the level, in the order of the file, from 1; 0: the pixel shows none
};

// What pixels show, [height][width], top row first. All but the colours is that of the point in the middle of a pixel.
struct PictureLayers {
    PictureLayers(int columns, int rows);

    int width, height;          // pixels
    std::vector<Float4> colour; // linear Rec. 709 times alpha, which is the share of the pixel that is covered
    std::vector<float> depth;   // along the view direction, model units; +infinity where nothing is
    std::vector<std::array<float, 3>> position, normal; // model space; zeros where nothing is. Normals have length 1
    std::vector<PointNumbers> numbers;
};

// A scanline file of one part, compressed by ZIP: R G B A as half floats, Z, P.X P.Y P.Z and N.X N.Y N.Z as floats,
// level.X, material.X and point.X as integers. Blender takes a name as that of a pass and a channel of one letter, Nuke
// as that of a layer and a channel. Where nothing is, Z is 1e10, as in Blender.
// Based on: OpenEXR. Technical Introduction; OpenEXRCore 3.1
//
// errors  unsupported_feature  OpenEXR is not installed, or was not there when the program was built
//         memory               the library refuses the picture
Result<Bytes> encode_exr(const PictureLayers &layers);

} // namespace pbm
