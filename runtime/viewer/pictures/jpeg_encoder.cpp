#include "viewer/pictures/jpeg_encoder.h"

#include <array>
#include <csetjmp>
#include <cstdio> // which jpeglib.h needs and does not include
#include <cstdlib>
#include <string>

#include <jpeglib.h>

namespace pbm {
namespace {

// The library reports errors by a callback that must not return; C++ exceptions cannot pass its frames.
struct Refusal {
    jpeg_error_mgr manager;
    std::jmp_buf back;
    std::array<char, JMSG_LENGTH_MAX> text;
};

void refuse(j_common_ptr codec) {
    auto *const refusal = reinterpret_cast<Refusal *>(codec->err); // `manager` is the first member
    codec->err->format_message(codec, refusal->text.data());
    std::longjmp(refusal->back, 1);
}

// Allocated by the library. longjmp runs no destructors, so this type has none.
struct Encoded {
    unsigned char *bytes = nullptr;
    unsigned long size = 0;
};

bool encode(const Framebuffer &picture, int quality, Refusal &refusal, Encoded &encoded) {
    jpeg_compress_struct codec{};
    codec.err = jpeg_std_error(&refusal.manager);
    refusal.manager.error_exit = refuse;
    if (setjmp(refusal.back) != 0) {
        jpeg_destroy_compress(&codec);
        return false;
    }
    jpeg_create_compress(&codec);
    jpeg_mem_dest(&codec, &encoded.bytes, &encoded.size);
    codec.image_width = static_cast<JDIMENSION>(picture.width);
    codec.image_height = static_cast<JDIMENSION>(picture.height);
    codec.input_components = 4;
    codec.in_color_space = JCS_EXT_RGBX;
    jpeg_set_defaults(&codec);
    jpeg_set_quality(&codec, quality, TRUE);
    jpeg_start_compress(&codec, TRUE);
    const auto columns = static_cast<std::size_t>(picture.width);
    while (codec.next_scanline < codec.image_height) {
        // The library does not write to its input, although its parameter is not const.
        auto *row = reinterpret_cast<JSAMPLE *>(
            const_cast<std::uint32_t *>(picture.colour.data() + codec.next_scanline * columns));
        jpeg_write_scanlines(&codec, &row, 1);
    }
    jpeg_finish_compress(&codec);
    jpeg_destroy_compress(&codec);
    return true;
}

} // namespace

Result<Bytes> encode_jpeg(const Framebuffer &picture, int quality) {
    Refusal refusal{};
    Encoded encoded;
    const bool done = encode(picture, quality, refusal, encoded);
    Bytes bytes;
    if (done)
        bytes.assign(encoded.bytes, encoded.bytes + encoded.size);
    std::free(encoded.bytes);
    if (!done)
        return Error{ErrorCode::memory, 0, std::string("the JPEG encoder failed: ") + refusal.text.data()};
    return bytes;
}

} // namespace pbm
