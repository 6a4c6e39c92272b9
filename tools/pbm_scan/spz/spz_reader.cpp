#include "pbm_scan/spz/spz_reader.h"

#include "pbm_scan/clouds/gaussian_splats.h"
#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/packing/compressed.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"
#include "system/bytes.h"

#include <glm/gtc/packing.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace pbm::build {
namespace {

struct SpzHeader {
    std::uint32_t version = 0;
    std::size_t splats = 0;
    int degree = 0, fraction_bits = 0, flags = 0;
    std::size_t streams = 0, table = 0; // of version 4
};

constexpr std::size_t kHeader = 16, kHeaderOf4 = 32;

Error cut_short(std::size_t at) { return bad_input("the SPZ file is cut short; copy or export it again", at); }

Result<SpzHeader> read_header(ByteView bytes) {
    if (bytes.size() < kHeader)
        return cut_short(bytes.size());
    SpzHeader header{.version = load<std::uint32_t>(bytes.data() + 4),
                     .splats = load<std::uint32_t>(bytes.data() + 8),
                     .degree = bytes[12],
                     .fraction_bits = bytes[13],
                     .flags = bytes[14]};
    if (header.version == 0 || header.version > 4)
        return Error{ErrorCode::unsupported_version, 4,
                     "SPZ version " + std::to_string(header.version) + "; export it as version 3, or as PLY"};
    if (header.splats == 0)
        return bad_input("the file has no splats: there is nothing to build");
    if (header.splats > kMaxVertices)
        return bad_input("the SPZ file announces " + std::to_string(header.splats) +
                             " splats: it is damaged; copy or export it again",
                         8);
    constexpr int kMaxDegree = 4, kMaxFraction = 24;
    if (header.degree > kMaxDegree || header.fraction_bits > kMaxFraction)
        return bad_input("the SPZ header is damaged", 12);
    if (header.version == 4) {
        if (bytes.size() < kHeaderOf4)
            return cut_short(bytes.size());
        header.streams = bytes[15];
        header.table = load<std::uint32_t>(bytes.data() + 16);
    }
    return header;
}

// The bytes of a splat in each stream.
struct SplatSizes {
    std::size_t place, colour = 3, scale = 3, rotation, harmonics;
    explicit SplatSizes(const SpzHeader &header)
        : place(header.version == 1 ? 6 : 9), rotation(header.version <= 2 ? 3 : 4),
          harmonics(3 * static_cast<std::size_t>((header.degree + 1) * (header.degree + 1) - 1)) {}
    std::size_t sum() const { return place + 1 + colour + scale + rotation + harmonics; }
};

// What is used of the splats.
struct Streams {
    // Of version 4.
    Bytes unpacked_places{}, unpacked_opacities{}, unpacked_colours{}, unpacked_scales{}, unpacked_rotations{};
    ByteView places{}, opacities{}, colours{}, scales{}, rotations{};
    std::size_t bytes_behind = 0;
};

Result<Streams> whole_streams(ByteView bytes, const SpzHeader &header) {
    const SplatSizes sizes(header);
    const std::size_t room = bytes.size() - kHeader;
    if (header.splats > room / sizes.sum())
        return bad_input("the SPZ file announces " + std::to_string(header.splats) + " splats and has room for " +
                             std::to_string(room / sizes.sum()) + ": it is cut short; copy or export it again",
                         8);
    Streams streams{.bytes_behind = room - header.splats * sizes.sum()};
    std::size_t at = kHeader;
    const auto take = [&](std::size_t size) {
        const ByteView taken = bytes.subspan(at, header.splats * size);
        at += taken.size();
        return taken;
    };
    streams.places = take(sizes.place);
    streams.opacities = take(1);
    streams.colours = take(sizes.colour);
    streams.scales = take(sizes.scale);
    streams.rotations = take(sizes.rotation);
    return streams;
}

// Version 4: a table of the packed and unpacked sizes of frames, and then the frames.
Result<Streams> packed_streams(ByteView bytes, const SpzHeader &header) {
    constexpr std::size_t kEntry = 16, kUsed = 5;
    if (header.table < kHeaderOf4 || header.table > bytes.size() || header.streams < kUsed ||
        header.streams > (bytes.size() - header.table) / kEntry)
        return bad_input("the table of streams of the SPZ file is damaged or cut short", 16);
    Streams streams;
    const SplatSizes sizes(header);
    const std::array<std::size_t, kUsed> sizes_of_splat{sizes.place, 1, sizes.colour, sizes.scale, sizes.rotation};
    const std::array<Bytes *, kUsed> to{&streams.unpacked_places, &streams.unpacked_opacities,
                                        &streams.unpacked_colours, &streams.unpacked_scales,
                                        &streams.unpacked_rotations};
    std::size_t at = header.table + header.streams * kEntry;
    for (std::size_t i = 0; i < header.streams; ++i) {
        const std::uint8_t *const entry = bytes.data() + header.table + i * kEntry;
        const auto packed = load<std::uint64_t>(entry), size = load<std::uint64_t>(entry + 8);
        if (packed > bytes.size() - at)
            return cut_short(bytes.size());
        if (i < kUsed) {
            if (size != header.splats * sizes_of_splat[i])
                return bad_input("stream " + std::to_string(i) + " of the SPZ file has not the size of " +
                                     std::to_string(header.splats) + " splats",
                                 header.table + i * kEntry + 8);
            auto content = unpacked(bytes.subspan(at, packed), size + 1);
            if (!content || !*content || (*content)->size() != size)
                return content && !*content
                           ? content->error()
                           : bad_input("stream " + std::to_string(i) + " of the SPZ file is damaged", at);
            *to[i] = std::move(**content);
        }
        at += packed;
    }
    streams.places = streams.unpacked_places;
    streams.opacities = streams.unpacked_opacities;
    streams.colours = streams.unpacked_colours;
    streams.scales = streams.unpacked_scales;
    streams.rotations = streams.unpacked_rotations;
    streams.bytes_behind = bytes.size() - at;
    return streams;
}

glm::dvec3 place_of(const std::uint8_t *at, const SpzHeader &header) {
    glm::dvec3 place;
    for (int axis = 0; axis < 3; ++axis)
        if (header.version == 1) {
            place[axis] = static_cast<double>(glm::unpackHalf1x16(load<std::uint16_t>(at + 2 * axis)));
        } else {
            const std::uint8_t *const b = at + 3 * axis;
            const auto bits = static_cast<std::uint32_t>(b[0]) << 8 | static_cast<std::uint32_t>(b[1]) << 16 |
                              static_cast<std::uint32_t>(b[2]) << 24;
            place[axis] = std::ldexp(static_cast<double>(static_cast<std::int32_t>(bits) >> 8), -header.fraction_bits);
        }
    return place;
}

glm::vec3 scale_of(const std::uint8_t *at) {
    const auto axis = [at](int i) { return exponential(static_cast<float>(at[i]) / 16 - 10); };
    return {axis(0), axis(1), axis(2)};
}

// Versions 1 and 2: x y z in a byte each; w is what is missing to 1. Later ones: the number of the largest of x y z w,
// and the three others as a sign and 9 bits, in units of sqrt(1/2).
glm::quat rotation_of(const std::uint8_t *at, const SpzHeader &header) {
    std::array<float, 4> numbers{}; // x y z w
    float rest = 1;
    std::size_t largest = 3;
    if (header.version <= 2) {
        for (std::size_t i = 0; i < 3; ++i)
            numbers[i] = static_cast<float>(at[i]) / 127.5F - 1;
    } else {
        auto packed = load<std::uint32_t>(at);
        largest = packed >> 30;
        constexpr std::uint32_t kMagnitude = 511;
        for (std::size_t i = 4; i-- > 0;) {
            if (i == largest)
                continue;
            const float magnitude = std::sqrt(0.5F) * static_cast<float>(packed & kMagnitude) / kMagnitude;
            numbers[i] = (packed >> 9 & 1) != 0 ? -magnitude : magnitude;
            packed >>= 10;
        }
    }
    for (std::size_t i = 0; i < 4; ++i)
        rest -= i == largest ? 0 : numbers[i] * numbers[i];
    numbers[largest] = std::sqrt(std::max(rest, 0.0F));
    return {numbers[3], numbers[0], numbers[1], numbers[2]};
}

// The coefficient of a byte.
float coefficient(std::uint8_t byte) { return (static_cast<float>(byte) / 255 - 0.5F) / 0.15F; }

} // namespace

bool is_spz(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kVersion = 4; // a text has letters there
    return as_text(bytes).starts_with("NGSP") && (bytes.size() <= kVersion || bytes[kVersion] < ' ');
}

Result<Surface> read_spz(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    const Result<SpzHeader> header = read_header(bytes);
    if (!header)
        return header.error();
    const Result<Streams> streams =
        header->version == 4 ? packed_streams(bytes, *header) : whole_streams(bytes, *header);
    if (!streams)
        return streams.error();
    Surface surface;
    const FieldColumn opacity = field_column(surface, options, "opacity");
    surface.positions.reserve(header->splats);
    surface.colours.reserve(header->splats);
    GaussianSplats splats;
    const std::size_t size = SplatSizes(*header).place, rotation = SplatSizes(*header).rotation;
    for (std::size_t i = 0; i < header->splats; ++i) {
        surface.positions.push_back(place_of(streams->places.data() + i * size, *header));
        const std::uint8_t *const colour = streams->colours.data() + 3 * i;
        surface.colours.push_back(
            splat_colour({coefficient(colour[0]), coefficient(colour[1]), coefficient(colour[2])}));
        opacity.add(static_cast<double>(streams->opacities[i]) / 255);
        splats.opacities.push_back(static_cast<float>(streams->opacities[i]) / 255);
        splats.scales.push_back(scale_of(streams->scales.data() + 3 * i));
        splats.rotations.push_back(rotation_of(streams->rotations.data() + rotation * i, *header));
    }
    surface.report.push_back({"positions", Fate::kept, "the centres of Gaussian splats"});
    surface.report.push_back({"colours", Fate::converted, kSplatColourNote});
    if (opacity.is_wanted())
        surface.report.push_back(field_report("opacity", opacity, ""));
    surface.report.push_back({"scales, rotations", Fate::converted, kSplatShapeNote});
    if (header->degree != 0)
        surface.report.push_back({"spherical harmonics", Fate::dropped, kSplatHarmonicsNote});
    if (header->flags != 0)
        surface.report.push_back({"flags", Fate::dropped, "they concern how the method's own program draws splats"});
    if (Status shown = show_discs(surface, splats, options); !shown)
        return shown.error();
    report_trailing(surface.report, streams->bytes_behind, "behind the last splat");
    return finished(std::move(surface), options);
}

} // namespace pbm::build
