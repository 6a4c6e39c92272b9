#include "pbm_scan/las/las_reader.h"

#include "pbm_scan/clouds/intensity.h"
#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/conventions/convention.h"
#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/las/las_measurements.h"
#include "pbm_scan/las/las_records.h"
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

bool is_withheld(const std::uint8_t *point, const PointFormat &format) {
    constexpr std::uint8_t kOld = 0x80, kNew = 0x04;
    return (point[15] & (format.is_new ? kNew : kOld)) != 0;
}

// The measurements of a file and the fields that they fill.
class Measurements {
  public:
    Measurements(const LasHeader &header, const ReadOptions &options, Surface &surface)
        : all_(las_measurements(header)) {
        std::vector<FieldOffer> offers;
        offers.reserve(all_.size());
        for (const LasMeasurement &measurement : all_)
            offers.push_back({measurement.name, measurement.unit});
        columns_ = field_columns(surface, options, offers, options.usual_fields);
        for (std::size_t i = 0; i < all_.size(); ++i)
            if (columns_[i].is_wanted())
                wanted_.emplace_back(&all_[i], &columns_[i]);
    }

    bool keeps_intensity() const { return columns_.front().is_kept(); }
    void add(const std::uint8_t *record) const {
        for (const auto &[measurement, column] : wanted_)
            column->add(measurement->value(record));
    }

    // Names those that are fields, and those that are not though one of them is not 0. `bits`: of the record, those
    // set in any point.
    void report(const LasHeader &header, ByteView bits, Surface &surface) const {
        std::vector<std::string> kept, dropped;
        for (std::size_t i = 0; i < all_.size(); ++i) {
            if (columns_[i].is_kept())
                kept.push_back(all_[i].name);
            else if (columns_[i].is_wanted())
                surface.report.push_back(field_report(all_[i].name, columns_[i], ""));
            else if (all_[i].raw(bits.data() + all_[i].at) != 0 && i != 0) // the intensity has a line of its own
                dropped.push_back(all_[i].name);
        }
        if (!kept.empty())
            surface.report.push_back({listed(kept), Fate::kept, kept.size() == 1 ? "a field" : "fields"});
        if (!dropped.empty())
            surface.report.push_back(
                {listed(dropped), Fate::dropped, "measurements that are not shown; --field NAME keeps one"});
        if (const std::string unused = unused_bytes(header, all_, bits); !unused.empty())
            surface.report.push_back({unused, Fate::dropped, "not used by PBM"});
    }

  private:
    std::vector<LasMeasurement> all_; // the first is the intensity
    std::vector<FieldColumn> columns_;
    std::vector<std::pair<const LasMeasurement *, const FieldColumn *>> wanted_;
};

// Colours of 16 bits; of 8 where nearly none is larger, as some writers leave them.
void keep_colours(const std::vector<std::array<std::uint16_t, 3>> &colours, Surface &surface) {
    std::uint64_t lit = 0, above_byte = 0;
    for (const auto &colour : colours) {
        const int bits = colour[0] | colour[1] | colour[2];
        lit += bits != 0 ? 1U : 0U;
        above_byte += bits > 255 ? 1U : 0U;
    }
    if (lit == 0) {
        surface.report.push_back({"colours", Fate::dropped, "all are black"});
        return;
    }
    const ColourRange range = range_of_words(lit, above_byte);
    const bool are_bytes = range.white == 255;
    surface.colours.reserve(colours.size());
    for (const auto &colour : colours) {
        Rgb8 bytes{};
        for (std::size_t c = 0; c < 3; ++c)
            bytes[c] = static_cast<std::uint8_t>(are_bytes ? std::min(colour[c], std::uint16_t{255})
                                                           : (colour[c] + 128U) / 257U);
        surface.colours.push_back(bytes);
    }
    surface.report.push_back(
        are_bytes ? AttributeReport{"colours", Fate::kept, "sRGB, of 8 bits though the format has 16" + range.note()}
                  : AttributeReport{"colours", Fate::converted, "sRGB, 16 bits to 8"});
}

void report_header(const LasHeader &header, std::uint64_t points, Surface &surface) {
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

bool is_las(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kVersion = 24; // a text has letters there
    return as_text(bytes).starts_with("LASF") && (bytes.size() <= kVersion || bytes[kVersion] < ' ');
}

Result<Surface> read_las(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    Result<LasHeader> header = read_las_header(bytes);
    if (!header)
        return header.error();
    const PointFormat &format = *header->format;
    Result<LasRecords> records = LasRecords::open(bytes, *header, options.threads);
    if (!records)
        return records.error();
    const std::uint64_t count = records->count();

    constexpr std::uint64_t kReported = 1 << 20;
    Surface surface;
    std::vector<float> intensities;
    std::vector<std::array<std::uint16_t, 3>> colours;
    surface.positions.reserve(count);
    intensities.reserve(count);
    colours.reserve(format.colour != 0 ? count : 0);
    const Measurements measurements(*header, options, surface);
    std::uint64_t withheld = 0, done = 0;
    Bytes bits(header->stride); // of the record, that are set in any point
    for (Result<ByteView> batch = records->next();; batch = records->next()) {
        if (!batch)
            return batch.error();
        if (batch->empty())
            break;
        for (std::size_t at = 0; at < batch->size(); at += header->stride) {
            const std::uint8_t *const point = batch->data() + at;
            for (std::size_t k = 0; k < bits.size(); ++k)
                bits[k] |= point[k];
            if (options.progress && done++ % kReported == 0)
                options.progress(static_cast<double>(done) / static_cast<double>(count));
            if (is_withheld(point, format)) {
                ++withheld;
                continue;
            }
            measurements.add(point);
            const glm::dvec3 record(load<std::int32_t>(point), load<std::int32_t>(point + 4),
                                    load<std::int32_t>(point + 8));
            surface.positions.push_back(record * header->scale + header->offset);
            intensities.push_back(static_cast<float>(load<std::uint16_t>(point + 12)));
            if (format.colour != 0)
                colours.push_back(load<std::array<std::uint16_t, 3>>(point + format.colour));
        }
    }
    surface.report.push_back({"x y z", Fate::kept,
                              withheld == 0
                                  ? "positions"
                                  : "positions; " + counted(withheld, "point") + " that the file withholds left out"});
    report_header(*header, count, surface);
    if (format.colour != 0)
        keep_colours(colours, surface);
    if (!measurements.keeps_intensity() &&
        std::any_of(intensities.begin(), intensities.end(), [](float value) { return value != 0; }))
        use_intensities("intensity", intensities, surface);
    measurements.report(*header, bits, surface);
    report_trailing(surface.report, records->bytes_behind(), "behind the last point");
    if (header->has_index)
        surface.report.push_back({"index of the points", Fate::kept, "not needed: all points are read"});
    if (header->lost_records != 0)
        surface.report.push_back(
            {"announced records", Fate::dropped, counted(header->lost_records, "record") + " not there or cut short"});
    if (header->has_superseded)
        surface.report.push_back({"superseded records", Fate::kept, "not needed: others replace them"});
    if (!header->other_records.empty())
        surface.report.push_back({"records " + listed(header->other_records), Fate::dropped, "not used by PBM"});
    surface.crs = std::move(header->crs);
    apply_crs(header->crs_facts, surface.convention);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
