#include "pbm_scan/las/las_reader.h"

#include "pbm_scan/clouds/intensity.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"
#include "system/bytes.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm::build {
namespace {

constexpr std::size_t kLeastHeader = 227, kHeaderOf14 = 375, kRecordHeader = 54;

// Where the fields of a point format lie; 0: it has none.
struct PointFormat {
    std::size_t size, time, colour, infrared, wave;
    bool is_new; // 6 to 10: flags and classes have bytes of their own
};
constexpr std::array<PointFormat, 11> kFormats{{{20, 0, 0, 0, 0, false},
                                                {28, 20, 0, 0, 0, false},
                                                {26, 0, 20, 0, 0, false},
                                                {34, 20, 28, 0, 0, false},
                                                {57, 20, 0, 0, 28, false},
                                                {63, 20, 28, 0, 34, false},
                                                {30, 22, 0, 0, 0, true},
                                                {36, 22, 30, 0, 0, true},
                                                {38, 22, 30, 36, 0, true},
                                                {59, 22, 0, 0, 30, true},
                                                {67, 22, 30, 36, 38, true}}};

struct Header {
    const PointFormat *format = nullptr;
    std::size_t first = 0, stride = 0; // of the points
    std::uint64_t announced = 0;
    bool has_records_behind = false; // behind the points
    glm::dvec3 scale{1}, offset{0}, lowest{0}, highest{0};
    std::string crs;
};

class HeaderReader {
  public:
    explicit HeaderReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

    Result<Header> run() {
        if (bytes_.size() < kLeastHeader)
            return bad_input("the LAS header is cut short", bytes_.size());
        const std::size_t size = at<std::uint16_t>(94);
        const int major = bytes_[24], minor = bytes_[25];
        if (major != 1 || minor > 5)
            return Error{ErrorCode::unsupported_version, 24,
                         "LAS " + std::to_string(major) + "." + std::to_string(minor) + "; export it as LAS 1.4"};
        if (size < kLeastHeader || size > bytes_.size() || (minor >= 4 && size < kHeaderOf14))
            return bad_input("the LAS header says that it has " + std::to_string(size) + " bytes", 94);
        Header header;
        header.first = at<std::uint32_t>(96);
        header.stride = at<std::uint16_t>(105);
        constexpr std::uint8_t kCompressed = 0xC0;
        if ((bytes_[104] & kCompressed) != 0)
            return unsupported("the file is LAZ, compressed LAS; unpack it to LAS");
        if (bytes_[104] >= kFormats.size())
            return bad_input("point format " + std::to_string(bytes_[104]) + " is none of LAS", 104);
        header.format = &kFormats[bytes_[104]];
        if (header.stride < header.format->size)
            return bad_input("points of " + std::to_string(header.stride) + " bytes, their format has " +
                                 std::to_string(header.format->size),
                             105);
        if (header.first < size || header.first > bytes_.size())
            return bad_input("the points begin at byte " + std::to_string(header.first) + " of " +
                                 std::to_string(bytes_.size()) + ": the file is cut short or damaged",
                             96);
        header.announced = at<std::uint32_t>(107);
        if (minor >= 4 && at<std::uint64_t>(247) != 0)
            header.announced = at<std::uint64_t>(247);
        constexpr std::uint16_t kWaveformsWithin = 2;
        header.has_records_behind = (minor >= 4 && at<std::uint32_t>(243) != 0) ||
                                    (minor >= 3 && (at<std::uint16_t>(6) & kWaveformsWithin) != 0);
        for (int axis = 0; axis < 3; ++axis) {
            const auto each = static_cast<std::size_t>(axis);
            header.scale[axis] = at<double>(131 + 8 * each);
            header.offset[axis] = at<double>(155 + 8 * each);
            header.highest[axis] = at<double>(179 + 16 * each);
            header.lowest[axis] = at<double>(187 + 16 * each);
        }
        if (!is_finite(header.offset) || !is_finite(header.scale) || header.scale.x == 0 || header.scale.y == 0 ||
            header.scale.z == 0)
            return bad_input("scale or offset of the coordinates is no finite number", 131);
        read_records(size, at<std::uint32_t>(100), header);
        return header;
    }

  private:
    template <class T> T at(std::size_t offset) const { return load<T>(bytes_.data() + offset); }

    // The text of the coordinate reference system among the variable length records.
    void read_records(std::size_t from, std::uint32_t count, Header &header) const {
        constexpr std::uint16_t kWkt = 2112;
        constexpr std::size_t kMostCrs = 4096;
        for (std::uint32_t i = 0; i < count && header.first - from >= kRecordHeader; ++i) {
            const std::string_view user = as_text(bytes_.subspan(from + 2, 16));
            const auto id = at<std::uint16_t>(from + 18);
            const std::size_t length = at<std::uint16_t>(from + 20);
            from += kRecordHeader;
            if (length > header.first - from)
                return;
            if (user.starts_with("LASF_Projection") && id == kWkt && length <= kMostCrs) {
                const std::string_view text = as_text(bytes_.subspan(from, length));
                header.crs = text.substr(0, text.find('\0'));
            }
            from += length;
        }
    }

    std::span<const std::uint8_t> bytes_;
};

bool is_withheld(const std::uint8_t *point, const PointFormat &format) {
    constexpr std::uint8_t kOld = 0x80, kNew = 0x04;
    return (point[15] & (format.is_new ? kNew : kOld)) != 0;
}

// Fields that the points have no place for, by name, where one of them is not 0.
std::string unused_fields(std::span<const std::uint8_t> points, const Header &header) {
    struct Unused {
        const char *name;
        std::size_t at, size;
    };
    const PointFormat &format = *header.format;
    std::vector<Unused> all{{"returns and flags", 14, 1},
                            {"classification", format.is_new ? 16U : 15U, 1},
                            {"user data", 17, 1},
                            {"scan angle", format.is_new ? 18U : 16U, format.is_new ? 2U : 1U},
                            {"point source", format.is_new ? 20U : 18U, 2}};
    for (const Unused &more : {Unused{"GPS time", format.time, 8}, Unused{"infrared", format.infrared, 2},
                               Unused{"waveform", format.wave, 29}})
        if (more.at != 0)
            all.push_back(more);
    if (header.stride > format.size)
        all.push_back({"extra bytes", format.size, header.stride - format.size});
    Bytes bits(header.stride); // that are set in any point
    for (std::size_t at = 0; at < points.size(); at += header.stride)
        for (std::size_t k = 0; k < header.stride; ++k)
            bits[k] |= points[at + k];
    std::vector<std::string_view> names;
    for (const Unused &field : all) {
        const ByteView of_field = ByteView(bits).subspan(field.at, field.size);
        if (std::any_of(of_field.begin(), of_field.end(), [](std::uint8_t byte) { return byte != 0; }))
            names.emplace_back(field.name);
    }
    return joined(names);
}

// Colours of 16 bits; of 8 where none is larger, as some writers leave them.
void keep_colours(const std::vector<std::array<std::uint16_t, 3>> &colours, Surface &surface) {
    std::uint16_t highest = 0;
    for (const auto &colour : colours)
        highest = std::max({highest, colour[0], colour[1], colour[2]});
    if (highest == 0) {
        surface.report.push_back({"colours", Fate::dropped, "all are black"});
        return;
    }
    const bool are_bytes = highest <= 255;
    surface.colours.reserve(colours.size());
    for (const auto &colour : colours) {
        Rgb8 bytes{};
        for (std::size_t c = 0; c < 3; ++c)
            bytes[c] = static_cast<std::uint8_t>(are_bytes ? colour[c] : (colour[c] + 128U) / 257U);
        surface.colours.push_back(bytes);
    }
    surface.report.push_back(are_bytes
                                 ? AttributeReport{"colours", Fate::kept, "sRGB, of 8 bits though the format has 16"}
                                 : AttributeReport{"colours", Fate::converted, "sRGB, 16 bits to 8"});
}

void report_header(const Header &header, std::uint64_t points, Surface &surface) {
    if (header.announced != points)
        surface.report.push_back(
            {"header", Fate::converted,
             "it announces " + std::to_string(header.announced) + " points; the file has " + std::to_string(points)});
    glm::dvec3 lowest(1e300), highest(-1e300);
    for (const glm::dvec3 &p : surface.positions) {
        lowest = glm::min(lowest, p);
        highest = glm::max(highest, p);
    }
    for (int axis = 0; axis < 3 && !surface.positions.empty(); ++axis) {
        const double step = 2 * std::abs(header.scale[axis]);
        if (!(std::abs(header.lowest[axis] - lowest[axis]) <= step) ||
            !(std::abs(header.highest[axis] - highest[axis]) <= step)) {
            surface.report.push_back({"header", Fate::converted, "its bounds are not those of the points"});
            return;
        }
    }
}

} // namespace

bool is_las(std::span<const std::uint8_t> bytes) { return as_text(bytes).starts_with("LASF"); }

Result<Surface> read_las(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    Result<Header> header = HeaderReader(bytes).run();
    if (!header)
        return header.error();
    const PointFormat &format = *header->format;
    const std::uint64_t room = (bytes.size() - header->first) / header->stride;
    if (header->announced > room)
        return bad_input("the file announces " + std::to_string(header->announced) + " points and has " +
                             std::to_string(room) + ": it is cut short; copy or export it again",
                         107);
    // Some writers forget the count. Where nothing may stand behind the points, the file's size tells it.
    const bool is_whole = (bytes.size() - header->first) % header->stride == 0;
    const std::uint64_t count = is_whole && !header->has_records_behind ? room : header->announced;
    if (count > kMaxVertices)
        return too_large("more than 2^31 - 1 points; split the scan", 107);
    const auto points = bytes.subspan(header->first, static_cast<std::size_t>(count) * header->stride);

    Surface surface;
    std::vector<float> intensities;
    std::vector<std::array<std::uint16_t, 3>> colours;
    surface.positions.reserve(count);
    intensities.reserve(count);
    colours.reserve(format.colour != 0 ? count : 0);
    std::uint64_t withheld = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint8_t *const point = points.data() + i * header->stride;
        if (is_withheld(point, format)) {
            ++withheld;
            continue;
        }
        const glm::dvec3 record(load<std::int32_t>(point), load<std::int32_t>(point + 4),
                                load<std::int32_t>(point + 8));
        surface.positions.push_back(record * header->scale + header->offset);
        intensities.push_back(static_cast<float>(load<std::uint16_t>(point + 12)));
        if (format.colour != 0)
            colours.push_back(load<std::array<std::uint16_t, 3>>(point + format.colour));
        constexpr std::uint64_t kReported = 1 << 20;
        if (options.progress && i % kReported == 0)
            options.progress(static_cast<double>(i) / static_cast<double>(count));
    }
    surface.report.push_back({"x y z", Fate::kept,
                              withheld == 0
                                  ? "positions"
                                  : "positions; " + counted(withheld, "point") + " that the file withholds left out"});
    report_header(*header, count, surface);
    if (format.colour != 0)
        keep_colours(colours, surface);
    if (std::any_of(intensities.begin(), intensities.end(), [](float value) { return value != 0; }))
        use_intensities(intensities, surface, "the points have colours");
    if (const std::string unused = unused_fields(points, *header); !unused.empty())
        surface.report.push_back({unused, Fate::dropped, "measurements that are not shown"});
    surface.crs = std::move(header->crs);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
