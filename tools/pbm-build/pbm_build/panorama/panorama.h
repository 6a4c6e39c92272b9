// Reads a panorama from an image file: decodes it, tone-maps a high dynamic range, and resamples it to a size that a
// .pbvg file can store. BVG.md 3.10
#pragma once

#include "pbm_format/model/model.h"
#include "system/error.h"

#include <cstdint>
#include <string>

namespace pbm::build {

// Maximum width of an image that is read, and of one that is stored by default.
inline constexpr std::uint32_t kMaxSourceWidth = 16384;
inline constexpr std::uint32_t kMaxDefaultWidth = 4096;

struct PanoramaOptions {
    std::uint32_t width = 0; // of the result, a power of two; 0: nearest to the image's, at most kMaxDefaultWidth
    double exposure = 1;     // of HDR images: factor on the exposure that follows from their mean luminance
};

struct Panorama {
    Image image;
    std::string note;       // format, size and conversions, for the report
    bool converted = false; // in size or in range
};

// The decoders run in a child process (child_process.h) under limits: 2 GiB and 60 s of computing.
//
// errors  io                   the system's own text
//         bad_input            no image, damaged, cut short, wider than kMaxSourceWidth, not twice as wide as high
//         unsupported_feature  a kind of image that is not read
//         memory               over a limit
Result<Panorama> read_panorama(const std::string &path, const PanoramaOptions &options);

} // namespace pbm::build
