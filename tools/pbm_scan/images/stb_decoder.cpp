#include "pbm_scan/images/stb_decoder.h"

#include "pbm_scan/surface/refusal.h"

#include <stb/stb_image.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

namespace pbm::build {
namespace {

// stb_image reads on behind the end of the data; `beyond_end` records it. Where it loops until it finds other bytes
// than `filler`, zeros would make it loop forever in an HDR image, 0xFF in the blocks of a GIF.
struct StbSource {
    ByteView left;
    int filler = 0;
    bool beyond_end = false;

    static int read(void *source, char *to, int wanted) {
        auto &self = *static_cast<StbSource *>(source);
        const std::size_t count = std::min(self.left.size(), static_cast<std::size_t>(wanted));
        if (count == 0) {
            self.beyond_end = true;
            std::memset(to, self.filler, static_cast<std::size_t>(wanted));
            return wanted;
        }
        std::memcpy(to, self.left.data(), count);
        self.left = self.left.subspan(count);
        return static_cast<int>(count);
    }
    static void skip(void *source, int count) {
        auto &self = *static_cast<StbSource *>(source);
        self.left = self.left.subspan(std::min(self.left.size(), static_cast<std::size_t>(std::max(count, 0))));
    }
    static int at_end(void *source) { return static_cast<StbSource *>(source)->left.empty() ? 1 : 0; }
};
constexpr stbi_io_callbacks kStbCallbacks{StbSource::read, StbSource::skip, StbSource::at_end};
constexpr int kHdrFiller = 0xFF;

std::string stb_reason() {
    const char *const reason = stbi_failure_reason();
    return reason == nullptr ? "no reason given" : reason;
}

constexpr const char *kOtherHdr = "an HDR image other than 32-bit_rle_rgbe, -Y +X; convert it with ImageMagick";

Error hdr_error() {
    const std::string why = stb_reason();
    if (why.find("unsupported") != std::string::npos)
        return unsupported(kOtherHdr);
    return damaged_image(why);
}

// stb_image knows no more than that where it does not decode a kind of BMP or PSD.
Error stb_error(ImageFormat format) {
    const std::string why = stb_reason();
    constexpr std::array<std::string_view, 5> kKinds{"unknown image type", "RLE", "wrong color format", "monochrome",
                                                     "unsupported"};
    if (std::any_of(kKinds.begin(), kKinds.end(), [&](auto kind) { return why.find(kind) != std::string::npos; }))
        return unsupported("a " + std::string(to_string(format)) +
                           " image that stb_image does not read: of another kind, or damaged; convert it to PNG");
    return damaged_image(why);
}

// stb_image takes packed samples of 16 bits for those of 8.
Status check_psd(ByteView bytes) {
    const auto number = [&](std::size_t at, std::size_t count) {
        std::size_t value = 0;
        for (std::size_t i = 0; i < count && at < bytes.size() && i < bytes.size() - at; ++i)
            value = value << 8 | bytes[at + i];
        return value;
    };
    constexpr std::size_t kDepth = 22, kHeader = 26;
    std::size_t at = kHeader;
    for (int section = 0; section < 3; ++section)
        at += 4 + number(at, 4);
    if (number(kDepth, 2) == 16 && number(at, 2) != 0)
        return unsupported("a PSD image of 16 bits whose picture is packed; convert it to PNG");
    return {};
}

// Verifies that the header ends: an empty line, then one with the size. stb_image would search for them behind the end.
// It also calls other forms damaged: rows from below or in columns ("+Y 512 +X 1024"), and colours as XYZ.
Status check_hdr_header(ByteView bytes) {
    const std::string_view text(reinterpret_cast<const char *>(bytes.data()), bytes.size());
    const std::size_t end = text.find("\n\n");
    if (end == std::string_view::npos || text.find('\n', end + 2) == std::string_view::npos)
        return damaged_image("its header has no end");
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

// The header of a TGA image. Truevision. TGA File Format Specification 2.0. 1991
struct TgaHeader {
    static constexpr std::size_t kBytes = 18;
    unsigned name = 0, has_map = 0, kind = 0, map_size = 0, map_bits = 0, width = 0, height = 0, bits = 0;

    explicit TgaHeader(ByteView bytes) {
        if (bytes.size() < kBytes)
            return;
        name = bytes[0];
        has_map = bytes[1];
        kind = bytes[2];
        map_size = load<std::uint16_t>(&bytes[5]);
        map_bits = bytes[7];
        width = load<std::uint16_t>(&bytes[12]);
        height = load<std::uint16_t>(&bytes[14]);
        bits = bytes[16];
    }
    bool is_compressed() const { return kind > 8; }
    bool is_valid() const {
        const unsigned colours = kind & 7U;
        const bool has_kind = (kind & ~15U) == 0 && colours >= 1 && colours <= 3 && (kind & 4U) == 0;
        const auto is_depth = [](unsigned depth) {
            return depth == 8 || depth == 15 || depth == 16 || depth == 24 || depth == 32;
        };
        const bool has_right_map = colours == 1 ? has_map == 1 && map_size != 0 && is_depth(map_bits) : has_map <= 1;
        return has_kind && has_right_map && width != 0 && height != 0 && is_depth(bits);
    }
    // Bytes that the file must have; of compressed pixels, stb_image notices where they end.
    std::uint64_t least_bytes() const {
        const std::uint64_t pixels = is_compressed() ? 0 : std::uint64_t{width} * height * ((bits + 7) / 8);
        return kBytes + name + (has_map == 1 ? std::uint64_t{map_size} * ((map_bits + 7) / 8) : 0) + pixels;
    }
};

// The header of a binary PNM image, as of netpbm's pages pgm(5) and ppm(5).
struct PnmHeader {
    std::uint64_t width = 0, height = 0, most = 0; // `most`: the value of white
    std::size_t end = 0, channels = 1;

    static std::optional<PnmHeader> of(ByteView bytes) {
        PnmHeader header{.end = 2, .channels = bytes.size() > 1 && bytes[1] == '6' ? 3U : 1U};
        for (std::uint64_t *number : {&header.width, &header.height, &header.most}) {
            while (header.end < bytes.size() && (std::isspace(bytes[header.end]) != 0 || bytes[header.end] == '#'))
                if (bytes[header.end] == '#')
                    while (header.end < bytes.size() && bytes[header.end] != '\n' && bytes[header.end] != '\r')
                        ++header.end;
                else
                    ++header.end;
            for (; header.end < bytes.size() && std::isdigit(bytes[header.end]) != 0 && *number < 1000000; ++header.end)
                *number = 10 * *number + bytes[header.end] - '0';
        }
        ++header.end; // one space
        return header.most >= 1 && header.most <= 65535 && header.end <= bytes.size() ? std::optional(header)
                                                                                      : std::nullopt;
    }
    std::size_t sample_bytes() const { return most > 255 ? 2 : 1; }
    std::uint64_t pixel_bytes() const { return width * height * channels * sample_bytes(); }
};

// stb_image 2.27 swaps no bytes of 16-bit samples, and takes white for 255 or 65,535 whatever the header says.
Status decode_pnm(ByteView bytes, std::size_t channels, const RowSink &take) {
    const std::optional<PnmHeader> header = PnmHeader::of(bytes);
    if (!header || bytes.size() - header->end < header->pixel_bytes())
        return damaged_image("pixels are missing");
    const int size = static_cast<int>(std::min<std::size_t>(bytes.size(), std::numeric_limits<int>::max()));
    int width = 0, height = 0, found = 0;
    const bool is_wide = header->sample_bytes() == 2;
    const std::unique_ptr<void, void (*)(void *)> pixels(
        is_wide ? static_cast<void *>(stbi_load_16_from_memory(bytes.data(), size, &width, &height, &found, 0))
                : stbi_load_from_memory(bytes.data(), size, &width, &height, &found, 0),
        stbi_image_free);
    if (pixels == nullptr || static_cast<std::size_t>(found) != header->channels)
        return stb_error(ImageFormat::pnm);
    const auto *const from = static_cast<const std::uint8_t *>(pixels.get());
    Bytes row(static_cast<std::size_t>(width) * channels, 255);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x)
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t at =
                    (y * static_cast<std::size_t>(width) + x) * header->channels + (header->channels == 3 ? c : 0);
                const std::uint64_t sample = is_wide ? std::uint64_t{from[2 * at]} << 8 | from[2 * at + 1] : from[at];
                row[channels * x + c] =
                    static_cast<std::uint8_t>((std::min(sample, header->most) * 255 + header->most / 2) / header->most);
            }
        take(row);
    }
    return {};
}

} // namespace

bool looks_like_tga(ByteView bytes) { return TgaHeader(bytes).is_valid(); }

Result<ImageSize> stb_size(ByteView bytes, ImageFormat format) {
    if (format == ImageFormat::hdr)
        if (Status header = check_hdr_header(bytes); !header)
            return header.error();
    StbSource source{.left = bytes, .filler = format == ImageFormat::hdr ? kHdrFiller : 0};
    int width = 0, height = 0, channels = 0;
    if (stbi_info_from_callbacks(&kStbCallbacks, &source, &width, &height, &channels) == 0)
        return format == ImageFormat::hdr ? hdr_error() : stb_error(format);
    if (width <= 0 || height <= 0)
        return damaged_image("its size is not positive");
    return ImageSize{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

Status decode_stb(ByteView bytes, ImageFormat format, std::size_t channels, const RowSink &take) {
    if (format == ImageFormat::pnm)
        return decode_pnm(bytes, channels, take);
    if (format == ImageFormat::tga && TgaHeader(bytes).least_bytes() > bytes.size())
        return damaged_image("pixels are missing");
    if (format == ImageFormat::psd)
        if (Status known = check_psd(bytes); !known)
            return known;
    StbSource source{.left = bytes};
    int width = 0, height = 0, found = 0;
    const std::unique_ptr<std::uint8_t, void (*)(void *)> pixels(
        stbi_load_from_callbacks(&kStbCallbacks, &source, &width, &height, &found, static_cast<int>(channels)),
        stbi_image_free);
    if (pixels == nullptr)
        return stb_error(format);
    if (source.beyond_end)
        return damaged_image("pixels are missing");
    const std::size_t row = static_cast<std::size_t>(width) * channels;
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
        take({pixels.get() + y * row, row});
    return {};
}

Result<std::vector<float>> decode_hdr(ByteView bytes) {
    if (Status header = check_hdr_header(bytes); !header)
        return header.error();
    StbSource source{.left = bytes, .filler = kHdrFiller};
    int width = 0, height = 0, channels = 0;
    const std::unique_ptr<float, void (*)(void *)> pixels(
        stbi_loadf_from_callbacks(&kStbCallbacks, &source, &width, &height, &channels, 3), stbi_image_free);
    if (pixels == nullptr)
        return hdr_error();
    if (source.beyond_end || width <= 0 || height <= 0)
        return damaged_image("pixels are missing");
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
    return std::vector<float>(pixels.get(), pixels.get() + count);
}

} // namespace pbm::build
