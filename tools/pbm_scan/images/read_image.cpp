#include "pbm_scan/images/read_image.h"

#include "pbm_scan/images/image_decoder.h"
#include "pbm_scan/surface/refusal.h"
#include "system/files/mapped_file.h"
#include "system/processes/child_process.h"

#include <array>
#include <cstring>

namespace pbm::build {
namespace {

Status check_size(const ImageSize &size) {
    if (size.width <= kMaxTextureEdge && size.height <= kMaxTextureEdge &&
        std::uint64_t{size.width} * size.height <= kMaxTextureTexels && size.width != 0 && size.height != 0)
        return {};
    return bad_input("the image has " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                     " pixels, more than can be read here; make it smaller");
}

// In the child: the size, the texels, and the remarks.
Status decode_and_send(ByteView bytes, ImageFormat format, bool are_colours, const ByteSink &send) {
    const Result<ImageSize> size = image_size(bytes, format);
    if (!size)
        return size.error();
    if (Status good = check_size(*size); !good)
        return good;
    send({reinterpret_cast<const std::uint8_t *>(&*size), sizeof *size});
    ImageRemarks remarks;
    Status decoded = decode_rows(bytes, format, 4, send, remarks, are_colours);
    send({reinterpret_cast<const std::uint8_t *>(&remarks), sizeof remarks});
    return decoded;
}

} // namespace

Result<Texture> read_image(ByteView bytes, bool are_colours) {
    const Result<ImageFormat> format = image_format(bytes);
    if (!format)
        return format.error();
    if (*format == ImageFormat::hdr)
        return unsupported("an HDR image as texture; convert it to PNG or JPEG");
    // Data of the child is untrusted.
    ImageSize size;
    Texture texture;
    ImageRemarks remarks;
    std::size_t received = 0;
    const auto astray = [] { return bad_input("the decoder went astray in this image; convert it to PNG"); };
    const auto receive = [&](ByteView part) -> Status {
        while (!part.empty()) {
            const std::span head(reinterpret_cast<std::uint8_t *>(&size), sizeof size);
            const std::span texels(reinterpret_cast<std::uint8_t *>(texture.texels.data()), 4 * texture.texels.size());
            const bool in_head = received < head.size(), in_texels = received < head.size() + texels.size();
            const std::span end(reinterpret_cast<std::uint8_t *>(&remarks), sizeof remarks);
            const std::span<std::uint8_t> to = in_head ? head : in_texels ? texels : end;
            const std::size_t at = received - (in_head ? 0 : in_texels ? head.size() : head.size() + texels.size());
            const std::size_t count = std::min(part.size(), to.size() - std::min(at, to.size()));
            if (count == 0)
                return astray();
            std::memcpy(to.data() + at, part.data(), count);
            part = part.subspan(count);
            received += count;
            if (received == sizeof size) {
                if (Status good = check_size(size); !good)
                    return good;
                texture.texels.resize(std::size_t{size.width} * size.height);
            }
        }
        return {};
    };
    const ChildTask task{
        .name = "the " + std::string(to_string(*format)) + " decoder",
        .advice = "convert the image to PNG",
        .limits = {.cpu_seconds = 60, .wall_seconds = 240, .memory = std::uint64_t{3} << 30},
        .work = [&](const ByteSink &send) { return decode_and_send(bytes, *format, are_colours, send); },
        .receive = receive};
    if (Status done = run_in_child(task); !done)
        return done.error();
    if (texture.texels.empty() || received != sizeof size + 4 * texture.texels.size() + sizeof remarks)
        return astray();
    texture.has_stray_bytes = remarks.has_stray_bytes != 0;
    texture.orientation = remarks.orientation;
    texture.width = size.width;
    texture.height = size.height;
    return texture;
}

Result<Texture> read_image_file(const std::string &path, bool are_colours) {
    const Result<MappedFile> file = MappedFile::open(path);
    return file ? read_image(file->bytes(), are_colours) : file.error();
}

} // namespace pbm::build
