#include "pbm_scan/las/las_reader.h"

#include "pbm_scan/clouds/intensity.h"
#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"
#include "system/bytes.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

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

template <class T> double number(const std::uint8_t *at) { return static_cast<double>(load<T>(at)); }

// A measurement of a point that can be a field.
struct Measurement {
    const char *name;
    std::size_t at, size;                       // in the record
    double (*value)(const std::uint8_t *bytes); // of the bytes at `at`
    const char *unit = "";
};

std::vector<Measurement> measurements_of(const PointFormat &format) {
    const bool is_new = format.is_new;
    std::vector<Measurement> all{
        {"intensity", 12, 2, number<std::uint16_t>},
        {"return_number", 14, 1,
         is_new ? +[](const std::uint8_t *b) { return double(*b & 15); }
                : +[](const std::uint8_t *b) { return double(*b & 7); }},
        {"number_of_returns", 14, 1,
         is_new ? +[](const std::uint8_t *b) { return double(*b >> 4); }
                : +[](const std::uint8_t *b) { return double(*b >> 3 & 7); }},
        {"classification", is_new ? 16U : 15U, 1,
         is_new ? +[](const std::uint8_t *b) { return double(*b); }
                : +[](const std::uint8_t *b) { return double(*b & 31); }},
        {"user_data", 17, 1, number<std::uint8_t>},
        {"scan_angle", is_new ? 18U : 16U, is_new ? 2U : 1U,
         is_new ? +[](const std::uint8_t *b) { return 0.006 * number<std::int16_t>(b); } : number<std::int8_t>, "deg"},
        {"point_source", is_new ? 20U : 18U, 2, number<std::uint16_t>}};
    if (format.time != 0)
        all.push_back({"gps_time", format.time, 8, number<double>, "s"});
    if (format.infrared != 0)
        all.push_back({"infrared", format.infrared, 2, number<std::uint16_t>});
    return all;
}

// Reports measurements that are fields, and those that are not though one of them is not 0.
void report_measurements(std::span<const Measurement> all, std::span<const FieldColumn> columns, const Bytes &bits,
                         const Header &header, Surface &surface) {
    const auto is_there = [&](std::size_t at, std::size_t size) {
        const ByteView bytes = ByteView(bits).subspan(at, size);
        return std::any_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte != 0; });
    };
    std::vector<std::string_view> kept, dropped;
    for (std::size_t i = 0; i < all.size(); ++i)
        if (columns[i].is_kept())
            kept.emplace_back(all[i].name);
        else if (is_there(all[i].at, all[i].size) && all[i].name != std::string_view("intensity"))
            dropped.emplace_back(all[i].name);
    if (!kept.empty())
        surface.report.push_back({joined(kept), Fate::kept, kept.size() == 1 ? "a field" : "fields"});
    if (!dropped.empty())
        surface.report.push_back(
            {joined(dropped), Fate::dropped, "measurements that are not shown; --field NAME keeps one"});
    const std::size_t size = header.format->size;
    if ((header.format->wave != 0 && is_there(header.format->wave, 29)) ||
        (header.stride > size && is_there(size, header.stride - size)))
        surface.report.push_back({"waveforms and extra bytes", Fate::dropped, "not used by PBM"});
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
    const std::vector<Measurement> measurements = measurements_of(format);
    std::vector<FieldColumn> columns_of_all;
    std::vector<std::pair<const Measurement *, const FieldColumn *>> wanted;
    for (const Measurement &measurement : measurements)
        columns_of_all.emplace_back(surface, options, measurement.name, measurement.unit);
    for (std::size_t i = 0; i < measurements.size(); ++i)
        if (columns_of_all[i].is_wanted())
            wanted.emplace_back(&measurements[i], &columns_of_all[i]);
    Bytes bits(header->stride); // that are set in any point
    std::uint64_t withheld = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint8_t *const point = points.data() + i * header->stride;
        for (std::size_t k = 0; k < header->stride; ++k)
            bits[k] |= point[k];
        if (is_withheld(point, format)) {
            ++withheld;
            continue;
        }
        for (const auto &[measurement, column] : wanted)
            column->add(measurement->value(point + measurement->at));
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
        use_intensities(intensities, surface,
                        columns_of_all.front().is_kept() ? "" : "the points have colours; --field intensity keeps it");
    report_measurements(measurements, columns_of_all, bits, *header, surface);
    surface.crs = std::move(header->crs);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
