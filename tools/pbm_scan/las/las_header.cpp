#include "pbm_scan/las/las_header.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/surface/surface.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"

#include <array>
#include <string_view>

namespace pbm::build {
namespace {

constexpr std::size_t kMinHeader = 227, kHeaderOf14 = 375, kRecordHeader = 54;

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

class LasHeaderReader {
  public:
    explicit LasHeaderReader(ByteView bytes) : bytes_(bytes) {}

    Result<LasHeader> run() {
        if (bytes_.size() < kMinHeader)
            return bad_input("the LAS header is cut short", bytes_.size());
        const std::size_t size = at<std::uint16_t>(94);
        const int major = bytes_[24], minor = bytes_[25];
        if (major != 1 || minor > 5)
            return Error{ErrorCode::unsupported_version, 24,
                         "LAS " + std::to_string(major) + "." + std::to_string(minor) + "; export it as LAS 1.4"};
        if (size < kMinHeader || size > bytes_.size() || (minor >= 4 && size < kHeaderOf14))
            return bad_input("the LAS header says that it has " + std::to_string(size) + " bytes", 94);
        LasHeader header;
        header.first = at<std::uint32_t>(96);
        header.stride = at<std::uint16_t>(105);
        constexpr std::uint8_t kCompressed = 0x80, kBeforeLaszip = 0x40;
        if ((bytes_[104] & kBeforeLaszip) != 0)
            return unsupported("the file was compressed before LASzip 1.0; unpack it to LAS");
        header.is_compressed = (bytes_[104] & kCompressed) != 0;
        const unsigned format = bytes_[104] & ~unsigned{kCompressed};
        if (format >= kFormats.size())
            return bad_input("point format " + std::to_string(format) + " is none of LAS", 104);
        header.format = &kFormats[format];
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
        const std::uint32_t records = at<std::uint32_t>(100), behind = minor >= 4 ? at<std::uint32_t>(243) : 0;
        header.lost_records = records - read_records(size, records, header);
        header.lost_records += behind - read_records_behind(behind == 0 ? 0 : at<std::uint64_t>(235), behind, header);
        set_crs(header);
        return header;
    }

  private:
    template <class T> T at(std::size_t offset) const { return load<T>(bytes_.data() + offset); }

    // Variable length records, between the header and the points. Returns how many of them are there.
    std::uint32_t read_records(std::size_t from, std::uint32_t count, LasHeader &header) {
        std::uint32_t read = 0;
        for (; read < count && header.first - from >= kRecordHeader; ++read) {
            const std::size_t length = at<std::uint16_t>(from + 20), content = from + kRecordHeader;
            if (length > header.first - content)
                break;
            take_record(from, content, length, header);
            from = content + length;
        }
        return read;
    }

    // Extended ones, which may lie behind the points.
    std::uint32_t read_records_behind(std::uint64_t from, std::uint32_t count, LasHeader &header) {
        constexpr std::size_t kLongHeader = 60;
        std::uint32_t read = 0;
        for (; read < count && from <= bytes_.size() && bytes_.size() - from >= kLongHeader; ++read) {
            const auto begin = static_cast<std::size_t>(from);
            const std::uint64_t length = at<std::uint64_t>(begin + 20), content = from + kLongHeader;
            if (length > bytes_.size() - content)
                break;
            take_record(begin, static_cast<std::size_t>(content), static_cast<std::size_t>(length), header);
            from = content + length;
        }
        return read;
    }

    // A record whose header begins at `from`.
    void take_record(std::size_t from, std::size_t content, std::size_t length, LasHeader &header) {
        constexpr std::uint16_t kWkt = 2112, kKeys = 34735, kNumbers = 34736, kTexts = 34737, kExtraBytes = 4,
                                kLaszip = 22204, kSuperseded = 7, kMathTransform = 2111;
        const std::string_view padded = as_text(bytes_.subspan(from + 2, 16)),
                               user = padded.substr(0, padded.find('\0'));
        const auto id = at<std::uint16_t>(from + 18);
        const ByteView bytes = bytes_.subspan(content, length);
        if ((user == "LASF_Projection" || (user == "liblas" && wkt_.empty())) && id == kWkt) {
            wkt_ = as_text(bytes).substr(0, as_text(bytes).find('\0'));
        } else if (user == "LASF_Projection" && (id == kKeys || id == kNumbers || id == kTexts)) {
            (id == kKeys ? geotiff_.keys : id == kNumbers ? geotiff_.numbers : geotiff_.texts) = bytes;
        } else if (user == "LASF_Spec" && id == kExtraBytes) {
            header.extra_bytes = bytes;
        } else if (user == "laszip encoded" && id == kLaszip) {
            header.laz_record = bytes;
            header.laz_offset = content;
        } else if (user == "copc" || user == "LAStools") {
            header.has_index = true;
        } else if (user == "LASF_Spec" && id == kSuperseded) {
            header.has_superseded = true;
        } else if (length != 0 && !(user == "LASF_Projection" && id == kMathTransform && length <= 1)) {
            const std::string name = printable(user) + " " + std::to_string(id);
            constexpr std::size_t kMaxNamed = 64;
            if (header.other_records.size() < kMaxNamed)
                header.other_records.push_back(name);
        }
    }

    // WKT comes before GeoTIFF keys.
    void set_crs(LasHeader &header) const {
        if (!wkt_.empty()) {
            header.crs_facts = facts_of(wkt_);
            header.crs = wkt_.size() <= kMaxCrsBytes ? std::string(wkt_) : short_crs(wkt_);
            return;
        }
        GeotiffCrs crs = read_geotiff(geotiff_);
        header.crs = std::move(crs.text);
        header.crs_facts = crs.facts;
    }

    std::string_view wkt_;
    GeotiffRecords geotiff_;
    ByteView bytes_;
};

} // namespace

Result<LasHeader> read_las_header(ByteView file) { return LasHeaderReader(file).run(); }

} // namespace pbm::build
