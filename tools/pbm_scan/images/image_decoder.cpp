#include "pbm_scan/images/image_decoder.h"

#include "pbm_scan/images/dds_decoder.h"
#include "pbm_scan/images/exif.h"
#include "pbm_scan/images/stb_decoder.h"
#include "pbm_scan/images/tiff_decoder.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/stand_in.h"

#include <jpeglib.h>

#include <jerror.h>
#include <png.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstring>
#include <memory>
#include <string>

namespace pbm::build {
namespace {

constexpr std::string_view kPngSignature{"\x89PNG\r\n\x1a\n", 8};

struct Signature {
    std::string_view bytes;
    std::size_t at;
    ImageFormat format;
};
constexpr std::array kSignatures{
    Signature{kPngSignature, 0, ImageFormat::png},  Signature{{"\xFF\xD8\xFF", 3}, 0, ImageFormat::jpeg},
    Signature{"WEBP", 8, ImageFormat::webp}, // behind "RIFF" and the size
    Signature{"#?RADIANCE\n", 0, ImageFormat::hdr}, Signature{"#?RGBE\n", 0, ImageFormat::hdr},
    Signature{"BM", 0, ImageFormat::bmp},           Signature{"GIF87a", 0, ImageFormat::gif},
    Signature{"GIF89a", 0, ImageFormat::gif},       Signature{"P5", 0, ImageFormat::pnm},
    Signature{"P6", 0, ImageFormat::pnm},           Signature{"8BPS", 0, ImageFormat::psd},
    Signature{{"II*\0", 4}, 0, ImageFormat::tiff},  Signature{{"MM\0*", 4}, 0, ImageFormat::tiff},
    Signature{{"II+\0", 4}, 0, ImageFormat::tiff}, // of more than 4 GiB
    Signature{{"MM\0+", 4}, 0, ImageFormat::tiff},  Signature{"DDS ", 0, ImageFormat::dds}};

struct ForeignImage {
    std::string_view bytes;
    std::size_t at;
    std::string_view name;
};
constexpr std::array kForeignImages{ForeignImage{"\xABKTX 20\xBB", 0, "KTX2"},
                                    ForeignImage{"\xABKTX 11\xBB", 0, "KTX"},
                                    ForeignImage{{"sB\x13\0", 4}, 0, "Basis"},
                                    ForeignImage{"\x76\x2F\x31\x01", 0, "OpenEXR"},
                                    ForeignImage{{"\0\0\0\x0CjP  ", 8}, 0, "JPEG 2000"},
                                    ForeignImage{{"\0\0\0\x0CJXL ", 8}, 0, "JPEG XL"},
                                    ForeignImage{"\xFF\x0A", 0, "JPEG XL"},
                                    ForeignImage{"ftypavif", 4, "AVIF"},
                                    ForeignImage{"ftypheic", 4, "HEIC"},
                                    ForeignImage{"ftypmif1", 4, "HEIC"},
                                    ForeignImage{"8BPB", 0, "PSB"},
                                    ForeignImage{"P1", 0, "plain PBM"},
                                    ForeignImage{"P2", 0, "plain PGM"},
                                    ForeignImage{"P3", 0, "plain PPM"},
                                    ForeignImage{"P4", 0, "PBM"},
                                    ForeignImage{"P7\n", 0, "PAM"},
                                    ForeignImage{"<svg", 0, "SVG"}};

// Verifies that the file ends with IEND: libpng stops after the last pixel. `plain` gets the file without the chunks
// that say what its colours are.
Status check_png_end(ByteView bytes, Bytes *plain) {
    std::size_t at = kPngSignature.size();
    if (plain != nullptr)
        plain->assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
    while (bytes.size() - at >= 12) { // length, type, CRC
        const std::size_t length = std::size_t{bytes[at]} << 24 | std::size_t{bytes[at + 1]} << 16 |
                                   std::size_t{bytes[at + 2]} << 8 | bytes[at + 3];
        if (length > bytes.size() - at - 12)
            break;
        const std::string_view type(reinterpret_cast<const char *>(bytes.data()) + at + 4, 4);
        const ByteView chunk = bytes.subspan(at, length + 12);
        if (plain != nullptr && type != "gAMA" && type != "cHRM" && type != "sRGB" && type != "iCCP")
            plain->insert(plain->end(), chunk.begin(), chunk.end());
        if (type == "IEND")
            return {};
        at += length + 12;
    }
    return damaged_image("it has no end");
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

Status decode_png(ByteView bytes, std::size_t channels, bool are_colours, const RowSink &take) {
    Bytes plain;
    if (Status whole = check_png_end(bytes, are_colours ? nullptr : &plain); !whole)
        return whole;
    PngImage image(are_colours ? bytes : ByteView(plain));
    if (!image.is_open)
        return damaged_image(image.png.message);
    image.png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB; // where no chunk says that 16 bits are linear
    // Without a background libpng drops the opacity of nothing but opaque images.
    const bool has_opacity = channels == 4 || (image.png.format & PNG_FORMAT_FLAG_ALPHA) != 0;
    image.png.format = has_opacity ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
    Bytes pixels(PNG_IMAGE_SIZE(image.png));
    if (png_image_finish_read(&image.png, nullptr, pixels.data(), 0, nullptr) == 0)
        return damaged_image(image.png.message);
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

Status decode_jpeg(ByteView bytes, std::size_t channels, const RowSink &take, ImageRemarks &remarks) {
    JpegReader reader;
    if (!read_jpeg_header(reader, bytes))
        return damaged_image(reader.message.data());
    const J_COLOR_SPACE colours = reader.info.jpeg_color_space;
    if (colours != JCS_YCbCr && colours != JCS_GRAYSCALE && colours != JCS_RGB)
        return unsupported("the JPEG is neither grey nor RGB; convert it to RGB");
    const bool started = survives(reader, [](jpeg_decompress_struct &info) {
        info.out_color_space = JCS_RGB;
        info.dct_method = JDCT_ISLOW; // the same bits on every machine
        return jpeg_start_decompress(&info) == TRUE;
    });
    if (!started)
        return damaged_image(reader.message.data());
    const std::size_t width = reader.info.output_width;
    Bytes row(width * 3), opaque(channels == 4 ? width * 4 : 0, 255);
    while (reader.info.output_scanline < reader.info.output_height) {
        std::uint8_t *to = row.data();
        if (!survives(reader, [&to](jpeg_decompress_struct &info) { return jpeg_read_scanlines(&info, &to, 1) == 1; }))
            return damaged_image(reader.message.data());
        for (std::size_t x = 0; 4 * x < opaque.size(); ++x)
            std::memcpy(opaque.data() + 4 * x, row.data() + 3 * x, 3);
        take(channels == 4 ? opaque : row);
    }
    const bool finished =
        survives(reader, [](jpeg_decompress_struct &info) { return jpeg_finish_decompress(&info) == TRUE; });
    remarks.has_stray_bytes = reader.has_stray_bytes ? 1 : 0;
    return finished ? Status() : Status(damaged_image(reader.message.data()));
}

Status decode_webp(ByteView bytes, std::size_t channels, const RowSink &take) {
    int width = 0, height = 0;
    const auto decode = channels == 4 ? WebPDecodeRGBA : WebPDecodeRGB;
    const std::unique_ptr<std::uint8_t, void (*)(void *)> pixels(decode(bytes.data(), bytes.size(), &width, &height),
                                                                 WebPFree);
    if (pixels == nullptr)
        return damaged_image("libwebp cannot decode it");
    const std::size_t row = static_cast<std::size_t>(width) * channels;
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
        take({pixels.get() + y * row, row});
    return {};
}

Result<ImageSize> webp_size(ByteView bytes) {
    WebPBitstreamFeatures features{};
    if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK)
        return damaged_image("its header cannot be read");
    if (features.has_animation != 0)
        return unsupported("an animated WebP image; export a single picture");
    return ImageSize{static_cast<std::uint32_t>(features.width), static_cast<std::uint32_t>(features.height)};
}

} // namespace

bool has_bytes(ByteView bytes, std::size_t at, std::string_view text) {
    return at <= bytes.size() && bytes.size() - at >= text.size() &&
           std::memcmp(bytes.data() + at, text.data(), text.size()) == 0;
}

Error damaged_image(const std::string &why) {
    return bad_input("the image is damaged or cut short (" + why + "); export it again");
}

std::string_view to_string(ImageFormat format) {
    constexpr std::array<std::string_view, 11> kNames{"PNG", "JPEG", "WebP", "HDR",  "TGA", "BMP",
                                                      "GIF", "PNM",  "PSD",  "TIFF", "DDS"};
    return kNames[static_cast<std::size_t>(format)];
}

Result<ImageFormat> image_format(ByteView bytes) {
    if (bytes.empty())
        return bad_input("the file is empty: this is no image");
    for (const Signature &known : kSignatures)
        if (has_bytes(bytes, known.at, known.bytes))
            return known.format;
    for (const ForeignImage &foreign : kForeignImages)
        if (has_bytes(bytes, foreign.at, foreign.bytes))
            return unsupported("a " + std::string(foreign.name) + " image, which is not read here; convert it to PNG");
    if (looks_like_tga(bytes))
        return ImageFormat::tga;
    if (const auto instead = stand_in({reinterpret_cast<const char *>(bytes.data()), bytes.size()}))
        return bad_input("the file is " + *instead);
    return bad_input(
        "no image that can be read here: PNG, JPEG, WebP, TIFF, TGA, BMP, GIF, PNM, PSD, DDS, Radiance HDR");
}

Result<ImageSize> image_size(ByteView bytes, ImageFormat format) {
    switch (format) {
    case ImageFormat::webp: return webp_size(bytes);
    case ImageFormat::tiff: return tiff_size(bytes);
    case ImageFormat::dds: return dds_size(bytes);
    case ImageFormat::png: {
        const PngImage image(bytes);
        if (!image.is_open)
            return damaged_image(image.png.message);
        return ImageSize{image.png.width, image.png.height};
    }
    case ImageFormat::jpeg: {
        JpegReader reader;
        if (!read_jpeg_header(reader, bytes))
            return damaged_image(reader.message.data());
        return ImageSize{reader.info.image_width, reader.info.image_height};
    }
    default: return stb_size(bytes, format);
    }
}

Status decode_rows(ByteView bytes, ImageFormat format, std::size_t channels, const RowSink &take, ImageRemarks &remarks,
                   bool are_colours) {
    remarks.orientation = exif_orientation(bytes, format);
    switch (format) {
    case ImageFormat::png: return decode_png(bytes, channels, are_colours, take);
    case ImageFormat::webp: return decode_webp(bytes, channels, take);
    case ImageFormat::jpeg: return decode_jpeg(bytes, channels, take, remarks);
    case ImageFormat::tiff: return decode_tiff(bytes, channels, take, remarks);
    case ImageFormat::dds: return decode_dds(bytes, channels, take);
    default: return decode_stb(bytes, format, channels, take);
    }
}

bool has_high_range(ByteView bytes, ImageFormat format) {
    return format == ImageFormat::hdr || (format == ImageFormat::tiff && is_float_tiff(bytes));
}

Result<std::vector<float>> decode_linear(ByteView bytes, ImageFormat format) {
    return format == ImageFormat::tiff ? decode_float_tiff(bytes) : decode_hdr(bytes);
}

} // namespace pbm::build
