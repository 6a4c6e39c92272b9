// PNG, JPEG and Radiance HDR images in memory to rows of pixels, through libpng, libjpeg and stb_image.
//
// What is decoded may be hostile and the libraries may fail: panorama.h calls this in a child process.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace pbm::build {

enum class ImageFormat : std::uint8_t { png, jpeg, hdr };
std::string_view to_string(ImageFormat format);

// By the first bytes.
//
// errors  bad_input  empty, or none of the three
Result<ImageFormat> image_format(ByteView bytes);

struct ImageSize {
    std::uint32_t width = 0, height = 0;
};

// From the header alone; nothing of the image's size is allocated.
//
// errors  bad_input  damaged or cut short
Result<ImageSize> image_size(ByteView bytes, ImageFormat format);

// Rows of sRGB pixels R, G, B from top to bottom. Grey becomes three channels, alpha is left out, 16 bits become 8.
//
// errors  bad_input            damaged or cut short, also where a decoder would go on with what it has
//         unsupported_feature  colours that are neither grey nor RGB
Status decode_rows(ByteView bytes, ImageFormat format, const std::function<void(std::span<const std::uint8_t>)> &take);

// Linear R, G, B, [height][width][3], top row first, of an HDR image: finite, not negative.
//
// errors  as decode_rows; other layouts than -Y +X are unsupported_feature
Result<std::vector<float>> decode_hdr(ByteView bytes);

} // namespace pbm::build
