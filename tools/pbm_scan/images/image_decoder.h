// Images in memory to rows of pixels, through libpng, libjpeg, libwebp, libtiff, libsquish and stb_image.
//
// Images are untrusted and the libraries may crash: call these functions in a child process.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

enum class ImageFormat : std::uint8_t { png, jpeg, webp, hdr, tga, bmp, gif, pnm, psd, tiff, dds };
std::string_view to_string(ImageFormat format);

// Recognises the format by the first bytes.
//
// errors  bad_input            empty, or none of these
//         unsupported_feature  a format of images that is not read, with its name
Result<ImageFormat> image_format(ByteView bytes);

struct ImageSize {
    std::uint32_t width = 0, height = 0;
};

// Reads the header alone; allocates nothing of the image's size.
//
// errors  bad_input  damaged or cut short
Result<ImageSize> image_size(ByteView bytes, ImageFormat format);

// What is said of an image besides its pixels.
struct ImageRemarks {
    std::uint8_t has_stray_bytes = 0; // 1: bytes of the file belong to no part of the image
    std::uint8_t orientation = 1;     // 1..8, exif.h; not applied
};

// Calls `take` with rows of sRGB pixels in the order of the file: R, G, B or, with `channels` 4, also the opacity.
// Expands grey to three channels, reduces 16 bits to 8. Linear light becomes sRGB; what is brighter than white is
// white. Without `are_colours` the numbers of a PNG stay as they are, whatever its chunks say of colours.
//
// errors  bad_input            damaged or cut short, also where the library would only warn and make up pixels
//         unsupported_feature  a kind of image that the library does not decode
using RowSink = std::function<void(std::span<const std::uint8_t>)>;
Status decode_rows(ByteView bytes, ImageFormat format, std::size_t channels, const RowSink &take, ImageRemarks &remarks,
                   bool are_colours = true);

// Whether an image has a high dynamic range: HDR, or a TIFF of floating-point numbers.
bool has_high_range(ByteView bytes, ImageFormat format);
// Linear R, G, B, [height][width][3], top row first, of such an image: finite, not negative.
//
// errors  as decode_rows; other layouts of HDR than -Y +X are unsupported_feature
Result<std::vector<float>> decode_linear(ByteView bytes, ImageFormat format);

// For decoders.
Error damaged_image(const std::string &why);
// Whether the bytes from `at` on begin with `text`; false behind the end.
bool has_bytes(ByteView bytes, std::size_t at, std::string_view text);

} // namespace pbm::build
