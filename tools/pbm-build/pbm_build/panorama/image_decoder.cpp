#include "pbm_build/panorama/image_decoder.h"

#include <jpeglib.h>
#include <png.h>
#include <stb/stb_image.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstring>
#include <memory>
#include <string>

namespace pbm::build {
namespace {

constexpr std::string_view kPngSignature{"\x89PNG\r\n\x1a\n", 8}, kJpegSignature{"\xFF\xD8\xFF", 3};
constexpr std::array<std::string_view, 2> kHdrSignatures{"#?RADIANCE\n", "#?RGBE\n"};

Error damaged(const std::string &why) {
    return {ErrorCode::bad_input, 0, "the image is damaged or cut short (" + why + "); export it again"};
}

bool starts_with(ByteView bytes, std::string_view text) {
    return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

// libpng is content with the last pixel; what follows it must be there, too.
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

// libpng's simplified interface: no long jump leaves it.
class PngImage {
  public:
    explicit PngImage(ByteView bytes) {
        image_.version = PNG_IMAGE_VERSION;
        open_ = png_image_begin_read_from_memory(&image_, bytes.data(), bytes.size()) != 0;
    }
    ~PngImage() { png_image_free(&image_); }
    PngImage(const PngImage &) = delete;
    PngImage &operator=(const PngImage &) = delete;

    bool is_open() const { return open_; }
    ImageSize size() const { return {image_.width, image_.height}; }
    Error error() const { return damaged(image_.message); }

    Result<Bytes> pixels() {
        image_.format = (image_.format & PNG_FORMAT_FLAG_ALPHA) != 0 ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
        Bytes pixels(PNG_IMAGE_SIZE(image_));
        if (png_image_finish_read(&image_, nullptr, pixels.data(), 0, nullptr) == 0)
            return error();
        return pixels;
    }
    std::size_t channels() const { return PNG_IMAGE_SAMPLE_CHANNELS(image_.format); }

  private:
    png_image image_{};
    bool open_ = false;
};

Status decode_png(ByteView bytes, const std::function<void(std::span<const std::uint8_t>)> &take) {
    if (Status whole = check_png_end(bytes); !whole)
        return whole;
    PngImage image(bytes);
    if (!image.is_open())
        return image.error();
    Result<Bytes> pixels = image.pixels();
    if (!pixels)
        return pixels.error();
    const std::size_t width = image.size().width, channels = image.channels();
    Bytes row(width * 3);
    for (std::size_t y = 0; y < image.size().height; ++y) {
        const std::uint8_t *from = pixels->data() + y * width * channels;
        for (std::size_t x = 0; x < width; ++x)
            std::memcpy(row.data() + 3 * x, from + channels * x, 3);
        take(row);
    }
    return {};
}

// libjpeg reports errors by a long jump to here; no object with a destructor lives between the two. Its warnings are
// errors, too: it says so where it invents what is missing.
struct JpegReader {
    jpeg_decompress_struct info{};
    jpeg_error_mgr errors{};
    std::jmp_buf on_error{};
    std::array<char, JMSG_LENGTH_MAX> message{};

    JpegReader() {
        info.err = jpeg_std_error(&errors);
        info.client_data = this;
        errors.error_exit = [](j_common_ptr common) { static_cast<JpegReader *>(common->client_data)->fail(); };
        errors.emit_message = [](j_common_ptr common, int level) {
            if (level < 0)
                static_cast<JpegReader *>(common->client_data)->fail();
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

bool read_jpeg_header(JpegReader &reader, ByteView bytes) {
    if (setjmp(reader.on_error) != 0)
        return false;
    jpeg_create_decompress(&reader.info);
    reader.info.client_data = &reader; // which creating has cleared
    jpeg_mem_src(&reader.info, bytes.data(), static_cast<unsigned long>(bytes.size()));
    jpeg_read_header(&reader.info, TRUE);
    return true;
}

bool start_jpeg(JpegReader &reader) {
    if (setjmp(reader.on_error) != 0)
        return false;
    reader.info.out_color_space = JCS_RGB;
    reader.info.dct_method = JDCT_ISLOW; // the same bits on every machine
    jpeg_start_decompress(&reader.info);
    return true;
}

bool read_jpeg_row(JpegReader &reader, std::uint8_t *row) {
    if (setjmp(reader.on_error) != 0)
        return false;
    return jpeg_read_scanlines(&reader.info, &row, 1) == 1;
}

bool finish_jpeg(JpegReader &reader) {
    if (setjmp(reader.on_error) != 0)
        return false;
    return jpeg_finish_decompress(&reader.info) == TRUE;
}

Status decode_jpeg(ByteView bytes, const std::function<void(std::span<const std::uint8_t>)> &take) {
    JpegReader reader;
    if (!read_jpeg_header(reader, bytes))
        return damaged(reader.message.data());
    const J_COLOR_SPACE colours = reader.info.jpeg_color_space;
    if (colours != JCS_YCbCr && colours != JCS_GRAYSCALE && colours != JCS_RGB)
        return Error{ErrorCode::unsupported_feature, 0, "the JPEG is neither grey nor RGB; convert it to RGB"};
    if (!start_jpeg(reader))
        return damaged(reader.message.data());
    Bytes row(std::size_t{reader.info.output_width} * 3);
    while (reader.info.output_scanline < reader.info.output_height) {
        if (!read_jpeg_row(reader, row.data()))
            return damaged(reader.message.data());
        take(row);
    }
    return finish_jpeg(reader) ? Status() : Status(damaged(reader.message.data()));
}

// stb_image goes on behind the end: with zeros it repeats empty runs for ever. Of 0xFF it makes pixels until it has
// enough or a run is too long, and that it came so far is remembered.
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

Error hdr_error() {
    const char *const reason = stbi_failure_reason();
    const std::string why = reason == nullptr ? "no reason given" : reason;
    if (why.find("unsupported") != std::string::npos)
        return {ErrorCode::unsupported_feature, 0,
                "an HDR image other than 32-bit_rle_rgbe, -Y +X; convert it with ImageMagick"};
    return damaged(why);
}

// Lines up to an empty one, then one with the size: behind the end there are no lines.
bool has_hdr_header(ByteView bytes) {
    const std::string_view text(reinterpret_cast<const char *>(bytes.data()), bytes.size());
    const std::size_t end = text.find("\n\n");
    return end != std::string_view::npos && text.find('\n', end + 2) != std::string_view::npos;
}

Result<ImageSize> hdr_size(ByteView bytes) {
    if (!has_hdr_header(bytes))
        return damaged("its header has no end");
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
    switch (format) {
    case ImageFormat::png: return "PNG";
    case ImageFormat::jpeg: return "JPEG";
    case ImageFormat::hdr: return "HDR";
    }
    return "unknown";
}

Result<ImageFormat> image_format(ByteView bytes) {
    if (bytes.empty())
        return Error{ErrorCode::bad_input, 0, "the file is empty: this is no image"};
    if (starts_with(bytes, kPngSignature))
        return ImageFormat::png;
    if (starts_with(bytes, kJpegSignature))
        return ImageFormat::jpeg;
    for (const std::string_view signature : kHdrSignatures)
        if (starts_with(bytes, signature))
            return ImageFormat::hdr;
    return Error{ErrorCode::bad_input, 0, "neither PNG nor JPEG nor Radiance HDR: no image that can be read here"};
}

Result<ImageSize> image_size(ByteView bytes, ImageFormat format) {
    if (format == ImageFormat::hdr)
        return hdr_size(bytes);
    if (format == ImageFormat::png) {
        const PngImage image(bytes);
        return image.is_open() ? Result<ImageSize>(image.size()) : Result<ImageSize>(image.error());
    }
    JpegReader reader;
    if (!read_jpeg_header(reader, bytes))
        return damaged(reader.message.data());
    return ImageSize{reader.info.image_width, reader.info.image_height};
}

Status decode_rows(ByteView bytes, ImageFormat format, const std::function<void(std::span<const std::uint8_t>)> &take) {
    return format == ImageFormat::png ? decode_png(bytes, take) : decode_jpeg(bytes, take);
}

Result<std::vector<float>> decode_hdr(ByteView bytes) {
    if (!has_hdr_header(bytes))
        return damaged("its header has no end");
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
