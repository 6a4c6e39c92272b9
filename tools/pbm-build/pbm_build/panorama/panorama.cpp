#include "pbm_build/panorama/panorama.h"

#include "pbm_build/panorama/resample.h"
#include "pbm_format/model/point_values.h"
#include "pbm_scan/images/image_decoder.h"
#include "pbm_scan/surface/refusal.h"
#include "system/files/mapped_file.h"
#include "system/processes/child_process.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace pbm::build {
namespace {

// Sent by the child before the texels.
struct Head {
    std::uint32_t width = 0, height = 0;          // of the image
    std::uint32_t stored_width = 0, channels = 0; // of the texels
    std::uint32_t tone_mapped = 0, orientation = 1;
};

std::string size_text(std::uint32_t width, std::uint32_t height) {
    return std::to_string(width) + " x " + std::to_string(height);
}

Status check_size(const ImageSize &size) {
    if (size.width > kMaxSourceWidth || size.height > kMaxSourceWidth / 2)
        return bad_input("the image has " + size_text(size.width, size.height) + " pixels, a panorama may have " +
                         size_text(kMaxSourceWidth, kMaxSourceWidth / 2) + "; make it smaller");
    const std::int64_t excess = std::int64_t{size.width} - 2 * std::int64_t{size.height};
    if (size.width < 2 || std::abs(excess) * 100 > std::int64_t{size.width})
        return bad_input("the image has " + size_text(size.width, size.height) +
                         " pixels; an equirectangular panorama is twice as wide as high");
    return {};
}

// The power of two nearest to `width` as a ratio.
std::uint32_t default_width(std::uint64_t width) {
    std::uint64_t power = 16;
    while (power < kMaxDefaultWidth && 2 * width * width > 4 * power * power)
        power *= 2;
    return static_cast<std::uint32_t>(power);
}

float luminance(const float *rgb) { return 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2]; }

// Geometric mean; weights the latitudes by a parabola instead of their cosine.
float mean_luminance(const std::vector<float> &pixels, std::size_t width) {
    constexpr float kMin = 1e-6F;
    const std::uint64_t height = pixels.size() / 3 / width;
    std::uint64_t sum = 0, weights = 0;
    for (std::uint64_t y = 0; y < height; ++y) {
        std::uint64_t row = 0;
        for (std::size_t x = 0; x < width; ++x)
            row += std::bit_cast<std::uint32_t>(std::max(luminance(&pixels[3 * (y * width + x)]), kMin));
        const std::uint64_t weight = 1 + 1024 * (2 * y + 1) * (2 * (height - y) - 1) / (4 * height * height);
        sum += row / width * weight;
        weights += weight;
    }
    return std::bit_cast<float>(static_cast<std::uint32_t>(sum / weights));
}

// Converts linear light, [height][width][3], to 0..65,535: scales the geometric mean luminance, weighted by solid
// angle, to middle grey x `exposure`, then compresses so that 16 times the luminance of white becomes white; keeps
// hues. Uses no transcendental function: the mean of the logarithms is approximated by the mean of the floats' bits.
// Based on: Reinhard, Stark, Shirley, Ferwerda. Photographic Tone Reproduction for Digital Images. 2002, equation 4
void tone_map(const std::vector<float> &pixels, std::uint32_t width, double exposure,
              std::vector<std::uint16_t> &linear) {
    constexpr double kMiddleGrey = 0.18, kWhite = 16;
    const double scale = kMiddleGrey * exposure / static_cast<double>(mean_luminance(pixels, width));
    linear.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); i += 3) {
        const double scaled = static_cast<double>(luminance(&pixels[i])) * scale;
        const double factor = scale * (1 + scaled / (kWhite * kWhite)) / (1 + scaled);
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = std::min(static_cast<double>(pixels[i + c]) * factor, 1.0);
            linear[i + c] = static_cast<std::uint16_t>(value * 65535 + 0.5);
        }
    }
}

Status resample_linear(ByteView bytes, ImageFormat format, const ImageSize &size, double exposure,
                       PanoramaResampler &to) {
    Result<std::vector<float>> pixels = decode_linear(bytes, format);
    if (!pixels)
        return pixels.error();
    std::vector<std::uint16_t> linear;
    tone_map(*pixels, size.width, exposure, linear);
    const std::size_t row = std::size_t{size.width} * 3;
    for (std::size_t y = 0; y < size.height; ++y)
        to.add_row({linear.data() + y * row, row});
    return {};
}

Status resample_rows(ByteView bytes, ImageFormat format, PanoramaResampler &to, ImageRemarks &remarks) {
    std::vector<std::uint16_t> linear;
    const auto add = [&](std::span<const std::uint8_t> row) {
        linear.resize(row.size());
        std::transform(row.begin(), row.end(), linear.begin(),
                       [](std::uint8_t value) { return linear_table()[value]; });
        to.add_row(linear);
    };
    return decode_rows(bytes, format, 3, add, remarks);
}

// In the child.
Status decode_and_send(ByteView bytes, ImageFormat format, const PanoramaOptions &options, const ByteSink &send) {
    const Result<ImageSize> size = image_size(bytes, format);
    if (!size)
        return size.error();
    if (Status good = check_size(*size); !good)
        return good;
    Head head{.width = size->width,
              .height = size->height,
              .stored_width = options.width != 0 ? options.width : default_width(size->width),
              .channels = 3,
              .tone_mapped = has_high_range(bytes, format) ? 1U : 0U};
    PanoramaResampler resampler(head.width, head.height, head.stored_width, head.stored_width / 2);
    ImageRemarks remarks;
    Status decoded = head.tone_mapped != 0 ? resample_linear(bytes, format, *size, options.exposure, resampler)
                                           : resample_rows(bytes, format, resampler, remarks);
    if (!decoded)
        return decoded;
    head.orientation = remarks.orientation;
    send({reinterpret_cast<const std::uint8_t *>(&head), sizeof head});
    const Image image = resampler.finish();
    send(image.texels);
    return {};
}

// The data of the child is untrusted.
Error astray() { return bad_input("the decoder went astray in this image; convert it to PNG"); }

bool is_resampled(const Head &head) { return head.width != head.stored_width || head.height != head.stored_width / 2; }

std::string note_of(ImageFormat format, const Head &head) {
    std::string note = std::string(to_string(format)) + ", " + size_text(head.width, head.height);
    if (head.tone_mapped != 0)
        note += ", tone-mapped";
    if (is_resampled(head))
        note += ", resampled to " + size_text(head.stored_width, head.stored_width / 2);
    if (head.orientation != 1)
        note += "; its orientation (" + std::to_string(head.orientation) + ") is not applied";
    return note;
}

} // namespace

Result<Panorama> read_panorama(const std::string &path, const PanoramaOptions &options) {
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        return file.error();
    const ByteView bytes = file->bytes();
    const Result<ImageFormat> format = image_format(bytes);
    if (!format)
        return format.error();
    Bytes received;
    const std::uint64_t most = sizeof(Head) + std::uint64_t{kMaxPanoramaWidth} * kMaxPanoramaWidth / 2 * 3;
    const ChildTask task{.name = "the " + std::string(to_string(*format)) + " decoder",
                         .advice = "convert the image to PNG",
                         .limits = {.cpu_seconds = 60, .wall_seconds = 240, .memory = std::uint64_t{2} << 30},
                         .work = [&](const ByteSink &send) { return decode_and_send(bytes, *format, options, send); },
                         .receive = [&](ByteView part) -> Status {
                             if (part.size() > most - received.size())
                                 return astray();
                             received.insert(received.end(), part.begin(), part.end());
                             return {};
                         }};
    if (Status done = run_in_child(task); !done)
        return done.error();
    Head head;
    if (received.size() < sizeof head)
        return astray();
    std::memcpy(&head, received.data(), sizeof head);
    received.erase(received.begin(), received.begin() + sizeof head);
    if (head.channels != 3 || !is_storable(head.stored_width, head.stored_width / 2, head.channels) ||
        received.size() != std::uint64_t{head.stored_width} * (head.stored_width / 2) * 3)
        return astray();
    return Panorama{.image = {head.stored_width, head.stored_width / 2, head.channels, std::move(received)},
                    .note = note_of(*format, head),
                    .converted = head.tone_mapped != 0 || is_resampled(head)};
}

} // namespace pbm::build
