#include "pbm_scan/images/exif.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::uint8_t kUpright = 1;

// A number of `bytes` bytes at `at`; 0 behind the end.
std::uint32_t number_at(ByteView from, std::size_t at, std::size_t bytes, bool is_big) {
    std::uint32_t number = 0;
    if (at > from.size() || from.size() - at < bytes)
        return 0;
    for (std::size_t i = 0; i < bytes; ++i)
        number = number << 8 | from[at + (is_big ? i : bytes - 1 - i)];
    return number;
}

// Of the first directory of a TIFF, which Exif data is.
std::uint8_t orientation_of_tiff(ByteView tiff) {
    constexpr std::uint32_t kOrientation = 0x112, kShort = 3;
    constexpr std::size_t kEntry = 12;
    const bool is_big = has_bytes(tiff, 0, "MM");
    if (!is_big && !has_bytes(tiff, 0, "II"))
        return kUpright;
    const std::size_t directory = number_at(tiff, 4, 4, is_big), entries = number_at(tiff, directory, 2, is_big);
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t entry = directory + 2 + kEntry * i;
        if (number_at(tiff, entry, 2, is_big) != kOrientation || number_at(tiff, entry + 2, 2, is_big) != kShort)
            continue;
        const std::uint32_t value = number_at(tiff, entry + 8, 2, is_big);
        return value >= 1 && value <= 8 ? static_cast<std::uint8_t>(value) : kUpright;
    }
    return kUpright;
}

// The Exif data of a JPEG: segments up to the first scan.
ByteView exif_of_jpeg(ByteView image) {
    constexpr std::uint32_t kFirst = 0xFFC0, kScan = 0xFFDA, kExif = 0xFFE1;
    constexpr std::string_view kName{"Exif\0\0", 6};
    for (std::size_t at = 2; image.size() - std::min(at, image.size()) > 4;) {
        const std::uint32_t marker = number_at(image, at, 2, true), size = number_at(image, at + 2, 2, true);
        if (marker < kFirst || marker == kScan || size < 2)
            break;
        if (marker == kExif && has_bytes(image, at + 4, kName))
            return image.subspan(at + 4 + kName.size());
        at += 2 + size;
    }
    return {};
}

// The Exif data of a PNG (`is_big`: length before type) or a WebP.
ByteView exif_of_chunks(ByteView image, std::size_t first, std::string_view type, bool is_big) {
    for (std::size_t at = first; image.size() - std::min(at, image.size()) > 8;) {
        const std::size_t size = number_at(image, is_big ? at : at + 4, 4, is_big);
        if (has_bytes(image, is_big ? at + 4 : at, type)) {
            const ByteView exif = image.subspan(at + 8);
            constexpr std::string_view kName{"Exif\0\0", 6};
            return has_bytes(exif, 0, kName) ? exif.subspan(kName.size()) : exif;
        }
        at += 8 + size + (is_big ? 4 : size % 2); // CRC, or padding
    }
    return {};
}

} // namespace

std::uint8_t exif_orientation(ByteView image, ImageFormat format) {
    switch (format) {
    case ImageFormat::jpeg: return orientation_of_tiff(exif_of_jpeg(image));
    case ImageFormat::png: return orientation_of_tiff(exif_of_chunks(image, 8, "eXIf", true));
    case ImageFormat::webp: return orientation_of_tiff(exif_of_chunks(image, 12, "EXIF", false));
    default: return kUpright;
    }
}

} // namespace pbm::build
