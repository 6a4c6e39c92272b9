// A panorama from an image file: decoded, tone-mapped where it has a high dynamic range, brought to a size that a .pbvg
// file holds. BVG.md section 3.10
#pragma once

#include "pbm_format/model/image.h"
#include "system/error.h"

#include <cstdint>
#include <string>
#include <vector>

namespace pbm::build {

// The widest image that is read, and the widest that is stored unless more is asked for.
inline constexpr std::uint32_t kMaxSourceWidth = 16384;
inline constexpr std::uint32_t kMaxDefaultWidth = 4096;

struct PanoramaOptions {
    std::uint32_t width = 0; // of the result, a power of two; 0: the one nearest to the image's, kMaxDefaultWidth at
                             // most
    double exposure = 1;     // of HDR images: times what their mean luminance asks for
};

struct Panorama {
    Image image;
    std::string note;       // what it was and what became of it
    bool converted = false; // in size or in range
};

// The decoders run in a child process (child_process.h) under limits: 2 GiB and 60 s of computing.
//
// errors  io                   the system's own text
//         bad_input            no image, damaged, cut short, wider than kMaxSourceWidth, not twice as wide as high
//         unsupported_feature  a kind of image that is not read
//         memory               over a limit
Result<Panorama> read_panorama(const std::string &path, const PanoramaOptions &options);

// Linear light of an HDR image, [height][width][3], to 0..65,535 in place of it: scaled so that its mean luminance,
// geometric and by solid angle, becomes middle grey times `exposure`, then compressed so that white is reached at
// 16 times white's luminance; hues stay. No transcendental function: the mean of logarithms is that of the numbers'
// bits.
// Based on: Reinhard, Stark, Shirley, Ferwerda. Photographic Tone Reproduction for Digital Images. 2002, equation 4
void tone_map(const std::vector<float> &pixels, std::uint32_t width, double exposure,
              std::vector<std::uint16_t> &linear);

} // namespace pbm::build
