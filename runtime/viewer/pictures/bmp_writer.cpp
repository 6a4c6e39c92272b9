#include "viewer/pictures/image_writer.h"

#include <algorithm>
#include <initializer_list>
#include <limits>

namespace pbm {
namespace {

constexpr std::uint32_t kFileHeader = 14, kInfoHeader = 40, kV4Header = 108;
constexpr std::uint32_t kNotCompressed = 0, kBitFields = 3;
constexpr std::uint32_t kSrgb = 0x73524742;     // 'sRGB'
constexpr std::uint32_t kPixelsPerMetre = 2835; // 72 per inch

struct Layout {
    explicit Layout(const Framebuffer &picture)
        : opaque(is_opaque(picture)), header(kFileHeader + (opaque ? kInfoHeader : kV4Header)),
          row((static_cast<std::uint64_t>(picture.width) * (opaque ? 3 : 4) + 3) / 4 * 4),
          size(header + row * static_cast<std::uint64_t>(picture.height)) {}

    bool opaque;
    std::uint32_t header;
    std::uint64_t row, size; // bytes
};

void write_headers(ByteWriter &out, const Framebuffer &picture, const Layout &layout) {
    const auto write = [&out](std::initializer_list<std::uint32_t> fields) {
        for (const std::uint32_t field : fields)
            out.u32(field);
    };
    const auto size = static_cast<std::uint32_t>(layout.size);
    const std::uint32_t planes = 1, bits = layout.opaque ? 24 : 32;
    out.u16('B' | 'M' << 8);
    write({size, 0, layout.header, layout.header - kFileHeader, static_cast<std::uint32_t>(picture.width),
           static_cast<std::uint32_t>(picture.height), planes | bits << 16, layout.opaque ? kNotCompressed : kBitFields,
           size - layout.header, kPixelsPerMetre, kPixelsPerMetre, 0, 0});
    if (!layout.opaque) // masks of red, green, blue, alpha
        write({0x00FF0000, 0x0000FF00, 0x000000FF, 0xFF000000, kSrgb});
    // End points and gammas follow: zeros, since sRGB implies them.
}

} // namespace

Result<Bytes> encode_bmp(const Framebuffer &picture) {
    const Layout layout(picture);
    if (layout.size > std::numeric_limits<std::uint32_t>::max())
        return Error{ErrorCode::memory, 0, "a BMP file ends at 4 GiB; write a PNG file"};
    ByteWriter headers;
    write_headers(headers, picture, layout);
    Bytes file(layout.size);
    std::copy(headers.bytes().begin(), headers.bytes().end(), file.begin());
    const auto columns = static_cast<std::size_t>(picture.width), rows = static_cast<std::size_t>(picture.height);
    const std::size_t channels = layout.opaque ? 3 : 4;
    for (std::size_t y = 0; y < rows; ++y) {
        const std::uint32_t *const from = picture.colour.data() + (rows - 1 - y) * columns;
        std::uint8_t *to = file.data() + layout.header + y * layout.row;
        for (std::size_t x = 0; x < columns; ++x, to += channels) {
            const Rgba8 pixel = unpack_rgba(from[x]);
            to[0] = pixel[2];
            to[1] = pixel[1];
            to[2] = pixel[0];
            if (channels == 4)
                to[3] = pixel[3];
        }
    }
    return file;
}

} // namespace pbm
