#include "pbm_scan/images/tiff_decoder.h"

#include "pbm_format/model/point_values.h"
#include "pbm_scan/surface/refusal.h"

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

namespace pbm::build {
namespace {

// An image in memory that libtiff reads.
class TiffFile {
  public:
    explicit TiffFile(ByteView bytes) : left_(bytes), bytes_(bytes) {
        TIFFOpenOptions *const options = TIFFOpenOptionsAlloc();
        TIFFOpenOptionsSetErrorHandlerExtR(options, &TiffFile::on_error, this);
        TIFFOpenOptionsSetWarningHandlerExtR(options, &TiffFile::on_warning, this);
        handle_ = TIFFClientOpenExt("image", "r", this, &TiffFile::read, &TiffFile::write, &TiffFile::seek,
                                    &TiffFile::close, &TiffFile::size, &TiffFile::map, &TiffFile::unmap, options);
        TIFFOpenOptionsFree(options);
    }
    ~TiffFile() {
        if (handle_ != nullptr)
            TIFFClose(handle_);
    }
    TiffFile(const TiffFile &) = delete;
    TiffFile &operator=(const TiffFile &) = delete;

    TIFF *handle() const { return handle_; } // null: not open
    // Of an error, or of a warning that means made-up pixels; empty: none.
    const std::string &message() const { return message_; }
    Error error() const {
        constexpr std::array<std::string_view, 3> kKinds{"can not handle", "not supported", "not implemented"};
        if (std::any_of(kKinds.begin(), kKinds.end(),
                        [&](auto kind) { return message_.find(kind) != std::string::npos; }))
            return unsupported("a TIFF image of a kind that is not read here (" + message_ + "); convert it to PNG");
        return damaged_image(message_.empty() ? "libtiff cannot read it" : message_);
    }

    // The value of a tag, or its default.
    std::uint16_t tag(std::uint32_t number) const {
        std::uint16_t value = 0;
        TIFFGetFieldDefaulted(handle_, number, &value);
        return value;
    }
    ImageSize image_size() const {
        ImageSize size;
        TIFFGetField(handle_, TIFFTAG_IMAGEWIDTH, &size.width);
        TIFFGetField(handle_, TIFFTAG_IMAGELENGTH, &size.height);
        return size;
    }

  private:
    static TiffFile &self(void *file) { return *static_cast<TiffFile *>(file); }
    static tmsize_t read(thandle_t file, void *to, tmsize_t wanted) {
        const std::size_t count = std::min(self(file).left_.size(), static_cast<std::size_t>(wanted));
        std::memcpy(to, self(file).left_.data(), count);
        self(file).left_ = self(file).left_.subspan(count);
        return static_cast<tmsize_t>(count);
    }
    static tmsize_t write(thandle_t, void *, tmsize_t) { return -1; }
    static toff_t seek(thandle_t file, toff_t offset, int origin) {
        const ByteView whole = self(file).bytes_;
        const toff_t from = origin == SEEK_SET   ? 0
                            : origin == SEEK_CUR ? whole.size() - self(file).left_.size()
                                                 : whole.size();
        const toff_t at = from + offset;
        self(file).left_ = whole.subspan(std::min<std::size_t>(at, whole.size()));
        return at;
    }
    static int close(thandle_t) { return 0; }
    static toff_t size(thandle_t file) { return self(file).bytes_.size(); }
    static int map(thandle_t file, void **base, toff_t *size) {
        *base = const_cast<std::uint8_t *>(self(file).bytes_.data()); // which libtiff only reads
        *size = self(file).bytes_.size();
        return 1;
    }
    static void unmap(thandle_t, void *, toff_t) {}

    static int on_error(TIFF *, void *file, const char *, const char *format, std::va_list values) {
        std::array<char, 256> text{};
        std::vsnprintf(text.data(), text.size(), format, values);
        if (self(file).message_.empty())
            self(file).message_ = text.data();
        return 1;
    }
    // libjpeg and the decoders of fax warn where they make up what is missing. Others warn of tags.
    static int on_warning(TIFF *tiff, void *file, const char *module, const char *format, std::va_list values) {
        const std::string_view name = module == nullptr ? "" : module;
        return name.starts_with("JPEG") || name.starts_with("Fax") ? on_error(tiff, file, module, format, values) : 1;
    }

    TIFF *handle_ = nullptr;
    ByteView left_, bytes_;
    std::string message_;
};

bool has_floats(const TiffFile &file) { return file.tag(TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_IEEEFP; }

// Whether the middle of the transfer function is that of a straight line from black to white.
bool is_straight(const TiffFile &file) {
    const std::uint16_t bits = file.tag(TIFFTAG_BITSPERSAMPLE);
    std::uint16_t *red = nullptr, *green = nullptr, *blue = nullptr;
    if (bits != 16 || TIFFGetField(file.handle(), TIFFTAG_TRANSFERFUNCTION, &red, &green, &blue) == 0 || red == nullptr)
        return false;
    constexpr int kTolerance = 256, kMiddle = 32768;
    return std::abs(int{red[kMiddle]} - kMiddle) < kTolerance;
}

// Linear light and opacity: grey or R, G, B, then the opacity if there is one.
struct TiffSamples {
    std::size_t channels = 0;  // 1 to 4
    std::vector<float> values; // [height][width][channels]
};

// A block of samples: a strip or a tile, of all samples or of one.
struct TiffBlock {
    std::uint32_t x = 0, y = 0, width = 0, height = 0; // on the image, and of a row of the block
    std::size_t first = 0, samples = 0;                // of a pixel
};

float sample_at(const std::uint8_t *at, std::size_t bytes) {
    constexpr float kWhite = 65535;
    return bytes == 2   ? static_cast<float>(load<std::uint16_t>(at)) / kWhite
           : bytes == 4 ? load<float>(at)
                        : static_cast<float>(load<double>(at));
}

void copy_block(const TiffBlock &block, const Bytes &from, std::size_t bytes, const ImageSize &size, TiffSamples &to) {
    for (std::uint32_t y = 0; y < block.height && block.y + y < size.height; ++y)
        for (std::uint32_t x = 0; x < block.width && block.x + x < size.width; ++x)
            for (std::size_t s = 0; s < block.samples && block.first + s < to.channels; ++s) {
                const std::size_t source = (std::size_t{y} * block.width + x) * block.samples + s;
                const std::size_t pixel = std::size_t{block.y + y} * size.width + block.x + x;
                to.values[pixel * to.channels + block.first + s] = sample_at(&from[source * bytes], bytes);
            }
}

// Samples as libtiff unpacks them, which converts no floating-point numbers.
Result<TiffSamples> read_samples(const TiffFile &file) {
    TIFF *const tiff = file.handle();
    const ImageSize size = file.image_size();
    const std::size_t bytes = file.tag(TIFFTAG_BITSPERSAMPLE) / 8U, samples = file.tag(TIFFTAG_SAMPLESPERPIXEL);
    const std::uint16_t colours = file.tag(TIFFTAG_PHOTOMETRIC);
    const std::size_t own = colours == PHOTOMETRIC_RGB ? 3 : 1;
    if ((colours != PHOTOMETRIC_RGB && colours != PHOTOMETRIC_MINISBLACK) || samples < own ||
        (bytes != 2 && bytes != 4 && bytes != 8) || (bytes == 2) != !has_floats(file))
        return unsupported("a TIFF image in linear light that is neither grey nor RGB of 32 or 64 bits; convert it to "
                           "PNG");
    TiffSamples made{.channels = std::min(samples, own + 1), .values = {}};
    made.values.resize(std::size_t{size.width} * size.height * made.channels);
    const bool is_tiled = TIFFIsTiled(tiff) != 0, is_apart = file.tag(TIFFTAG_PLANARCONFIG) == PLANARCONFIG_SEPARATE;
    TiffBlock block{.width = size.width, .height = size.height, .samples = is_apart ? 1 : samples};
    TIFFGetFieldDefaulted(tiff, is_tiled ? TIFFTAG_TILELENGTH : TIFFTAG_ROWSPERSTRIP, &block.height);
    if (is_tiled)
        TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &block.width);
    block.height = is_tiled ? block.height : std::min(block.height, size.height);
    if (block.width == 0 || block.height == 0)
        return damaged_image("its blocks are empty");
    Bytes unpacked;
    const std::uint64_t block_bytes = std::uint64_t{block.width} * block.height * block.samples * bytes;
    if (block_bytes > std::uint64_t{1} << 31)
        return bad_input("the image has blocks of more than 2 GiB; write it with smaller ones");
    unpacked.resize(block_bytes);
    for (block.first = 0; block.first < (is_apart ? made.channels : 1); ++block.first)
        for (block.y = 0; block.y < size.height; block.y += block.height)
            for (block.x = 0; block.x < size.width; block.x += block.width) {
                const std::uint32_t rows = is_tiled ? block.height : std::min(block.height, size.height - block.y);
                const auto wanted = static_cast<tmsize_t>(block_bytes / block.height * rows);
                const auto plane = static_cast<std::uint16_t>(block.first);
                const tmsize_t got =
                    is_tiled
                        ? TIFFReadEncodedTile(tiff, TIFFComputeTile(tiff, block.x, block.y, 0, plane), unpacked.data(),
                                              wanted)
                        : TIFFReadEncodedStrip(tiff, TIFFComputeStrip(tiff, block.y, plane), unpacked.data(), wanted);
                if (got != wanted || !file.message().empty())
                    return file.error();
                copy_block(block, unpacked, bytes, size, made);
            }
    return made;
}

// What the sample behind the colours means: nothing, an opacity, or one that the colours are multiplied with.
std::uint16_t extra_of(const TiffFile &file) {
    std::uint16_t count = 0, *kinds = nullptr;
    TIFFGetFieldDefaulted(file.handle(), TIFFTAG_EXTRASAMPLES, &count, &kinds);
    return count == 0 || kinds == nullptr ? std::uint16_t{EXTRASAMPLE_UNSPECIFIED} : kinds[0];
}

std::uint8_t byte_of(float value) {
    constexpr float kWhite = 255;
    return static_cast<std::uint8_t>(value > 0 ? std::min(value, 1.0F) * kWhite + 0.5F : 0);
}

std::uint8_t srgb_of(float linear) {
    constexpr float kWhite = 65535;
    return linear_to_srgb(static_cast<std::uint32_t>(linear > 0 ? std::min(linear, 1.0F) * kWhite + 0.5F : 0));
}

Status decode_samples(const TiffFile &file, std::size_t channels, const RowSink &take) {
    const Result<TiffSamples> samples = read_samples(file);
    if (!samples)
        return samples.error();
    const ImageSize size = file.image_size();
    const std::size_t own = samples->channels < 3 ? 1 : 3;
    const std::uint16_t extra = samples->channels > own ? extra_of(file) : std::uint16_t{EXTRASAMPLE_UNSPECIFIED};
    Bytes row(std::size_t{size.width} * channels);
    for (std::size_t y = 0; y < size.height; ++y) {
        for (std::size_t x = 0; x < size.width; ++x) {
            const float *const pixel = &samples->values[(y * size.width + x) * samples->channels];
            const float opacity = extra == EXTRASAMPLE_UNSPECIFIED ? 1 : pixel[own];
            const float share = extra == EXTRASAMPLE_ASSOCALPHA && opacity > 0 ? 1 / opacity : 1;
            for (std::size_t c = 0; c < 3; ++c)
                row[channels * x + c] = srgb_of(share * pixel[own == 3 ? c : 0]);
            if (channels == 4)
                row[channels * x + 3] = byte_of(opacity);
        }
        take(row);
    }
    return {};
}

} // namespace

Result<ImageSize> tiff_size(ByteView bytes) {
    const TiffFile file(bytes);
    if (file.handle() == nullptr)
        return file.error();
    return file.image_size();
}

bool is_float_tiff(ByteView bytes) {
    const TiffFile file(bytes);
    return file.handle() != nullptr && has_floats(file);
}

Result<std::vector<float>> decode_float_tiff(ByteView bytes) {
    const TiffFile file(bytes);
    if (file.handle() == nullptr)
        return file.error();
    const Result<TiffSamples> samples = read_samples(file);
    if (!samples)
        return samples.error();
    std::vector<float> colours(samples->values.size() / samples->channels * 3);
    for (std::size_t i = 0; i < colours.size(); ++i) {
        const float value = samples->values[i / 3 * samples->channels + (samples->channels < 3 ? 0 : i % 3)];
        colours[i] = value > 0 && std::isfinite(value) ? value : 0;
    }
    return colours;
}

Status decode_tiff(ByteView bytes, std::size_t channels, const RowSink &take, ImageRemarks &remarks) {
    const TiffFile file(bytes);
    if (file.handle() == nullptr)
        return file.error();
    const std::uint16_t orientation = file.tag(TIFFTAG_ORIENTATION);
    remarks.orientation = static_cast<std::uint8_t>(orientation);
    if (has_floats(file) || is_straight(file))
        return decode_samples(file, channels, take);
    const ImageSize size = file.image_size();
    std::vector<std::uint32_t> raster(std::size_t{size.width} * size.height);
    // As the file has them: libtiff turns nothing where both orientations are the same.
    if (TIFFReadRGBAImageOriented(file.handle(), size.width, size.height, raster.data(), orientation, 1) == 0 ||
        !file.message().empty())
        return file.error();
    Bytes row(std::size_t{size.width} * channels);
    for (std::size_t y = 0; y < size.height; ++y) {
        for (std::size_t x = 0; x < size.width; ++x) {
            // libtiff multiplies all colours with their opacity.
            const std::uint32_t pixel = raster[y * size.width + x], opacity = TIFFGetA(pixel);
            const std::array<std::uint32_t, 4> from{TIFFGetR(pixel), TIFFGetG(pixel), TIFFGetB(pixel), opacity};
            for (std::size_t c = 0; c < channels; ++c)
                row[channels * x + c] = static_cast<std::uint8_t>(
                    c == 3 || opacity == 0 || opacity == 255
                        ? from[c]
                        : std::min<std::uint32_t>((from[c] * 255 + opacity / 2) / opacity, 255));
        }
        take(row);
    }
    return {};
}

} // namespace pbm::build
