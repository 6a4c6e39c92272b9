#include "pbm_scan/images/image_decoder.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/stand_in.h"

#include <jpeglib.h>

#include <jerror.h>
#include <png.h>
#include <stb/stb_image.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>

namespace pbm::build {
namespace {

constexpr std::string_view kPngSignature{"\x89PNG\r\n\x1a\n", 8}, kJpegSignature{"\xFF\xD8\xFF", 3};
constexpr std::array<std::string_view, 2> kHdrSignatures{"#?RADIANCE\n", "#?RGBE\n"};

Error damaged(const std::string &why) {
    return bad_input("the image is damaged or cut short (" + why + "); export it again");
}

bool starts_with(ByteView bytes, std::string_view text) {
    return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

// Verifies that the file ends with IEND: libpng stops after the last pixel.
Status check_png_end(ByteView bytes) {
    std::size_t at = kPngSignature.size();
    while (bytes.size() - at >= 12) { // length, type, CRC
        const std::size_t length = std::size_t{bytes[at]} << 24 | std::size_t{bytes[at + 1]} << 16 |
                                   std::size_t{bytes[at + 2]} << 8 | bytes[at + 3];
        if (length > bytes.size() - at - 12)
            break;
        if (std::memcmp(bytes.data() + at + 4, "IEND", 4) == 0)
            return {};
        at += length + 12;
    }
    return damaged("it has no end");
}

// libpng's simplified interface, which needs no setjmp.
struct PngImage {
    png_image png{};
    bool is_open = false;

    explicit PngImage(ByteView bytes) {
        png.version = PNG_IMAGE_VERSION;
        is_open = png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) != 0;
    }
    ~PngImage() { png_image_free(&png); }
    PngImage(const PngImage &) = delete;
    PngImage &operator=(const PngImage &) = delete;
};

Status decode_png(ByteView bytes, std::size_t channels, const RowSink &take) {
    if (Status whole = check_png_end(bytes); !whole)
        return whole;
    PngImage image(bytes);
    if (!image.is_open)
        return damaged(image.png.message);
    image.png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB; // where no chunk says that 16 bits are linear
    // Without a background libpng drops the opacity of nothing but opaque images.
    const bool has_opacity = channels == 4 || (image.png.format & PNG_FORMAT_FLAG_ALPHA) != 0;
    image.png.format = has_opacity ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
    Bytes pixels(PNG_IMAGE_SIZE(image.png));
    if (png_image_finish_read(&image.png, nullptr, pixels.data(), 0, nullptr) == 0)
        return damaged(image.png.message);
    const std::size_t width = image.png.width, from_channels = PNG_IMAGE_SAMPLE_CHANNELS(image.png.format);
    Bytes row(width * channels);
    for (std::size_t y = 0; y < image.png.height; ++y) {
        const std::uint8_t *from = pixels.data() + y * width * from_channels;
        for (std::size_t x = 0; x < width; ++x)
            std::memcpy(row.data() + channels * x, from + from_channels * x, channels);
        take(row);
    }
    return {};
}

// libjpeg reports errors by a long jump to on_error. Warnings count as errors where libjpeg makes up missing data.
struct JpegReader {
    jpeg_decompress_struct info{};
    jpeg_error_mgr errors{};
    std::jmp_buf on_error{};
    std::array<char, JMSG_LENGTH_MAX> message{};
    bool has_stray_bytes = false;

    JpegReader() {
        info.err = jpeg_std_error(&errors);
        info.client_data = this;
        errors.error_exit = [](j_common_ptr common) { static_cast<JpegReader *>(common->client_data)->fail(); };
        errors.emit_message = [](j_common_ptr common, int level) {
            auto &reader = *static_cast<JpegReader *>(common->client_data);
            const int code = common->err->msg_code;
            const bool is_harmless =
                code == JWRN_EXTRANEOUS_DATA || code == JWRN_TOO_MUCH_DATA || code == JWRN_ADOBE_XFORM;
            if (level < 0 && !is_harmless)
                reader.fail();
            reader.has_stray_bytes = reader.has_stray_bytes || level < 0;
        };
    }
    ~JpegReader() { jpeg_destroy_decompress(&info); }
    JpegReader(const JpegReader &) = delete;
    JpegReader &operator=(const JpegReader &) = delete;

    [[noreturn]] void fail() {
        errors.format_message(reinterpret_cast<j_common_ptr>(&info), message.data());
        std::longjmp(on_error, 1);
    }
};

// False if `step` ends in a long jump. `step` must hold no object with a destructor.
template <class Step> bool survives(JpegReader &reader, const Step &step) {
    if (setjmp(reader.on_error) != 0)
        return false;
    return step(reader.info);
}

bool read_jpeg_header(JpegReader &reader, ByteView bytes) {
    return survives(reader, [&](jpeg_decompress_struct &info) {
        jpeg_create_decompress(&info);
        info.client_data = &reader; // which creating has cleared
        jpeg_mem_src(&info, bytes.data(), static_cast<unsigned long>(bytes.size()));
        return jpeg_read_header(&info, TRUE) == JPEG_HEADER_OK;
    });
}

Status decode_jpeg(ByteView bytes, std::size_t channels, const RowSink &take, bool *has_stray_bytes) {
    JpegReader reader;
    if (!read_jpeg_header(reader, bytes))
        return damaged(reader.message.data());
    const J_COLOR_SPACE colours = reader.info.jpeg_color_space;
    if (colours != JCS_YCbCr && colours != JCS_GRAYSCALE && colours != JCS_RGB)
        return unsupported("the JPEG is neither grey nor RGB; convert it to RGB");
    const bool started = survives(reader, [](jpeg_decompress_struct &info) {
        info.out_color_space = JCS_RGB;
        info.dct_method = JDCT_ISLOW; // the same bits on every machine
        return jpeg_start_decompress(&info) == TRUE;
    });
    if (!started)
        return damaged(reader.message.data());
    const std::size_t width = reader.info.output_width;
    Bytes row(width * 3), opaque(channels == 4 ? width * 4 : 0, 255);
    while (reader.info.output_scanline < reader.info.output_height) {
        std::uint8_t *to = row.data();
        if (!survives(reader, [&to](jpeg_decompress_struct &info) { return jpeg_read_scanlines(&info, &to, 1) == 1; }))
            return damaged(reader.message.data());
        for (std::size_t x = 0; 4 * x < opaque.size(); ++x)
            std::memcpy(opaque.data() + 4 * x, row.data() + 3 * x, 3);
        take(channels == 4 ? opaque : row);
    }
    const bool finished =
        survives(reader, [](jpeg_decompress_struct &info) { return jpeg_finish_decompress(&info) == TRUE; });
    if (has_stray_bytes != nullptr)
        *has_stray_bytes = reader.has_stray_bytes;
    return finished ? Status() : Status(damaged(reader.message.data()));
}

Status decode_webp(ByteView bytes, std::size_t channels, const RowSink &take) {
    int width = 0, height = 0;
    const auto decode = channels == 4 ? WebPDecodeRGBA : WebPDecodeRGB;
    const std::unique_ptr<std::uint8_t, void (*)(void *)> pixels(decode(bytes.data(), bytes.size(), &width, &height),
                                                                 WebPFree);
    if (pixels == nullptr)
        return damaged("libwebp cannot decode it");
    const std::size_t row = static_cast<std::size_t>(width) * channels;
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
        take({pixels.get() + y * row, row});
    return {};
}

Result<ImageSize> webp_size(ByteView bytes) {
    WebPBitstreamFeatures features{};
    if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK)
        return damaged("its header cannot be read");
    if (features.has_animation != 0)
        return unsupported("an animated WebP image; export a single picture");
    return ImageSize{static_cast<std::uint32_t>(features.width), static_cast<std::uint32_t>(features.height)};
}

// stb_image reads on behind the end of the data. Zeros would make it loop forever, so it gets 0xFF, which end the image
// or fail, and `beyond_end` records it.
struct HdrSource {
    ByteView left;
    bool beyond_end = false;

    static int read(void *source, char *to, int wanted) {
        auto &self = *static_cast<HdrSource *>(source);
        const std::size_t count = std::min(self.left.size(), static_cast<std::size_t>(wanted));
        if (count == 0) {
            self.beyond_end = true;
            std::memset(to, 0xFF, static_cast<std::size_t>(wanted));
            return wanted;
        }
        std::memcpy(to, self.left.data(), count);
        self.left = self.left.subspan(count);
        return static_cast<int>(count);
    }
    static void skip(void *source, int count) {
        auto &self = *static_cast<HdrSource *>(source);
        self.left = self.left.subspan(std::min(self.left.size(), static_cast<std::size_t>(std::max(count, 0))));
    }
    static int at_end(void *source) { return static_cast<HdrSource *>(source)->left.empty() ? 1 : 0; }
};
constexpr stbi_io_callbacks kHdrCallbacks{HdrSource::read, HdrSource::skip, HdrSource::at_end};

constexpr const char *kOtherHdr = "an HDR image other than 32-bit_rle_rgbe, -Y +X; convert it with ImageMagick";

Error hdr_error() {
    const char *const reason = stbi_failure_reason();
    const std::string why = reason == nullptr ? "no reason given" : reason;
    if (why.find("unsupported") != std::string::npos)
        return unsupported(kOtherHdr);
    return damaged(why);
}

// Verifies that the header ends: an empty line, then one with the size. stb_image would search for them behind the end.
// It also calls other forms damaged: rows from below or in columns ("+Y 512 +X 1024"), and colours as XYZ.
Status check_hdr_header(ByteView bytes) {
    const std::string_view text(reinterpret_cast<const char *>(bytes.data()), bytes.size());
    const std::size_t end = text.find("\n\n");
    if (end == std::string_view::npos || text.find('\n', end + 2) == std::string_view::npos)
        return damaged("its header has no end");
    std::istringstream words(std::string(text.substr(end + 2, 40)));
    std::string first, rows, second;
    words >> first >> rows >> second;
    const auto is_axis = [](const std::string &word) {
        return word == "-X" || word == "+X" || word == "-Y" || word == "+Y";
    };
    const bool other_axes = is_axis(first) && is_axis(second) && (first != "-Y" || second != "+X");
    const bool xyz = text.substr(0, end).find("\nFORMAT=32-bit_rle_xyze") != std::string_view::npos;
    return other_axes || xyz ? unsupported(kOtherHdr) : Status();
}

Result<ImageSize> hdr_size(ByteView bytes) {
    if (Status header = check_hdr_header(bytes); !header)
        return header.error();
    HdrSource source{.left = bytes};
    int width = 0, height = 0, channels = 0;
    if (stbi_info_from_callbacks(&kHdrCallbacks, &source, &width, &height, &channels) == 0)
        return hdr_error();
    if (width <= 0 || height <= 0)
        return damaged("its size is not positive");
    return ImageSize{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

} // namespace

std::string_view to_string(ImageFormat format) {
    constexpr std::array<std::string_view, 4> kNames{"PNG", "JPEG", "WebP", "HDR"};
    return kNames[static_cast<std::size_t>(format)];
}

Result<ImageFormat> image_format(ByteView bytes) {
    if (bytes.empty())
        return bad_input("the file is empty: this is no image");
    if (starts_with(bytes, kPngSignature))
        return ImageFormat::png;
    if (starts_with(bytes, kJpegSignature))
        return ImageFormat::jpeg;
    constexpr std::size_t kWebPAt = 8; // behind "RIFF" and the size
    if (starts_with(bytes, "RIFF") && bytes.size() > kWebPAt && starts_with(bytes.subspan(kWebPAt), "WEBP"))
        return ImageFormat::webp;
    for (const std::string_view signature : kHdrSignatures)
        if (starts_with(bytes, signature))
            return ImageFormat::hdr;
    if (const auto instead = stand_in({reinterpret_cast<const char *>(bytes.data()), bytes.size()}))
        return bad_input("the file is " + *instead);
    return bad_input("neither PNG nor JPEG nor WebP nor Radiance HDR: no image that can be read here");
}

Result<ImageSize> image_size(ByteView bytes, ImageFormat format) {
    if (format == ImageFormat::hdr)
        return hdr_size(bytes);
    if (format == ImageFormat::webp)
        return webp_size(bytes);
    if (format == ImageFormat::png) {
        const PngImage image(bytes);
        if (!image.is_open)
            return damaged(image.png.message);
        return ImageSize{image.png.width, image.png.height};
    }
    JpegReader reader;
    if (!read_jpeg_header(reader, bytes))
        return damaged(reader.message.data());
    return ImageSize{reader.info.image_width, reader.info.image_height};
}

Status decode_rows(ByteView bytes, ImageFormat format, std::size_t channels, const RowSink &take,
                   bool *has_stray_bytes) {
    switch (format) {
    case ImageFormat::png: return decode_png(bytes, channels, take);
    case ImageFormat::webp: return decode_webp(bytes, channels, take);
    case ImageFormat::jpeg:
    case ImageFormat::hdr: break;
    }
    return decode_jpeg(bytes, channels, take, has_stray_bytes);
}

Result<std::vector<float>> decode_hdr(ByteView bytes) {
    if (Status header = check_hdr_header(bytes); !header)
        return header.error();
    HdrSource source{.left = bytes};
    int width = 0, height = 0, channels = 0;
    const std::unique_ptr<float, void (*)(void *)> pixels(
        stbi_loadf_from_callbacks(&kHdrCallbacks, &source, &width, &height, &channels, 3), stbi_image_free);
    if (pixels == nullptr)
        return hdr_error();
    if (source.beyond_end || width <= 0 || height <= 0)
        return damaged("pixels are missing");
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
    return std::vector<float>(pixels.get(), pixels.get() + count);
}

} // namespace pbm::build
