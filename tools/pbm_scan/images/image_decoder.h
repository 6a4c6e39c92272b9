// PNG, JPEG, WebP and Radiance HDR images in memory to rows of pixels, through libpng, libjpeg, libwebp and stb_image.
//
// Images are untrusted and the libraries may crash: call these functions in a child process.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace pbm::build {

enum class ImageFormat : std::uint8_t { png, jpeg, webp, hdr };
std::string_view to_string(ImageFormat format);

// Recognises the format by the first bytes.
//
// errors  bad_input  empty, or none of these
Result<ImageFormat> image_format(ByteView bytes);

struct ImageSize {
    std::uint32_t width = 0, height = 0;
};

// Reads the header alone; allocates nothing of the image's size.
//
// errors  bad_input  damaged or cut short
Result<ImageSize> image_size(ByteView bytes, ImageFormat format);

// Calls `take` with rows of sRGB pixels from top to bottom: R, G, B or, with `channels` 4, also the opacity. Expands
// grey to three channels, reduces 16 bits to 8.
//
// `has_stray_bytes` becomes true where bytes of the image belong to no part of it.
//
// errors  bad_input            damaged or cut short, also where the library would only warn and make up pixels
//         unsupported_feature  colours that are neither grey nor RGB
using RowSink = std::function<void(std::span<const std::uint8_t>)>;
Status decode_rows(ByteView bytes, ImageFormat format, std::size_t channels, const RowSink &take,
                   bool *has_stray_bytes = nullptr);

// Linear R, G, B, [height][width][3], top row first, of an HDR image: finite, not negative.
//
// errors  as decode_rows; other layouts than -Y +X are unsupported_feature
Result<std::vector<float>> decode_hdr(ByteView bytes);

} // namespace pbm::build
