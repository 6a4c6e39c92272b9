#include "pbm_scan/las/las_measurements.h"

#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/text/text_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pbm::build {
namespace {

template <class T> double number(const std::uint8_t *at) { return static_cast<double>(load<T>(at)); }
template <int Shift, int Mask> double bits(const std::uint8_t *at) { return static_cast<double>(*at >> Shift & Mask); }

struct NumberType {
    std::size_t size;
    double (*load)(const std::uint8_t *bytes);
};
// Types 1 to 10 of extra bytes.
constexpr std::array<NumberType, 10> kTypes{{{1, number<std::uint8_t>},
                                             {1, number<std::int8_t>},
                                             {2, number<std::uint16_t>},
                                             {2, number<std::int16_t>},
                                             {4, number<std::uint32_t>},
                                             {4, number<std::int32_t>},
                                             {8, number<std::uint64_t>},
                                             {8, number<std::int64_t>},
                                             {4, number<float>},
                                             {8, number<double>}}};

// "No data" is a value of 64 bits of the type's kind: unsigned, signed, or a double.
double missing_value(unsigned type, const std::uint8_t *at) {
    return type > 8 ? number<double>(at) : type % 2 == 0 ? number<std::int64_t>(at) : number<std::uint64_t>(at);
}

void add_extra_bytes(const LasHeader &header, std::vector<LasMeasurement> &all) {
    constexpr std::size_t kDescription = 192, kNameSize = 32;
    constexpr unsigned kHasMissing = 1, kHasScale = 8, kHasOffset = 16;
    std::size_t at = header.format->size;
    for (ByteView left = header.extra_bytes; left.size() >= kDescription; left = left.subspan(kDescription)) {
        const unsigned code = left[2], options = left[3], type = code == 0 ? 0 : (code - 1) % 10 + 1;
        if (code > 30)
            return; // its size is not known, nor where those behind it lie
        if (code == 0) {
            at += options; // so many bytes without a meaning
            continue;
        }
        const std::size_t elements = (code - 1) / 10 + 1, size = kTypes[type - 1].size;
        const std::string_view padded = as_text(left.subspan(4, kNameSize));
        const std::string name(padded.substr(0, padded.find('\0')));
        for (std::size_t i = 0; i < elements; ++i, at += size) {
            if (at + size > header.stride)
                return;
            const auto of_element = [&](std::size_t from) { return left.data() + from + 8 * i; };
            LasMeasurement extra{.name = elements == 1 ? name : name + std::to_string(i),
                                 .at = at,
                                 .size = size,
                                 .raw = kTypes[type - 1].load};
            if ((options & kHasScale) != 0)
                extra.scale = number<double>(of_element(112));
            if ((options & kHasOffset) != 0)
                extra.offset = number<double>(of_element(136));
            if ((options & kHasMissing) != 0)
                extra.missing = missing_value(type, of_element(40));
            if (!name.empty())
                all.push_back(std::move(extra));
        }
    }
}

} // namespace

double LasMeasurement::value(const std::uint8_t *record) const {
    const double number = raw(record + at);
    return missing && number == *missing ? std::numeric_limits<double>::quiet_NaN() : number * scale + offset;
}

std::vector<LasMeasurement> las_measurements(const LasHeader &header) {
    const PointFormat &format = *header.format;
    std::vector<LasMeasurement> all{{"intensity", 12, 2, number<std::uint16_t>}};
    if (format.is_new)
        all.insert(
            all.end(),
            {{"return_number", 14, 1, bits<0, 15>},
             {"number_of_returns", 14, 1, bits<4, 15>},
             {"synthetic", 15, 1, bits<0, 1>},
             {"key_point", 15, 1, bits<1, 1>},
             {"overlap", 15, 1, bits<3, 1>},
             {"scanner_channel", 15, 1, bits<4, 3>},
             {"scan_direction", 15, 1, bits<6, 1>},
             {"edge_of_flight_line", 15, 1, bits<7, 1>},
             {"classification", 16, 1, number<std::uint8_t>},
             {"user_data", 17, 1, number<std::uint8_t>},
             {.name = "scan_angle", .at = 18, .size = 2, .raw = number<std::int16_t>, .scale = 0.006, .unit = "deg"},
             {"point_source", 20, 2, number<std::uint16_t>}});
    else
        all.insert(all.end(), {{"return_number", 14, 1, bits<0, 7>},
                               {"number_of_returns", 14, 1, bits<3, 7>},
                               {"scan_direction", 14, 1, bits<6, 1>},
                               {"edge_of_flight_line", 14, 1, bits<7, 1>},
                               {"classification", 15, 1, bits<0, 31>},
                               {"synthetic", 15, 1, bits<5, 1>},
                               {"key_point", 15, 1, bits<6, 1>},
                               {.name = "scan_angle", .at = 16, .size = 1, .raw = number<std::int8_t>, .unit = "deg"},
                               {"user_data", 17, 1, number<std::uint8_t>},
                               {"point_source", 18, 2, number<std::uint16_t>}});
    if (format.time != 0)
        all.push_back({.name = "gps_time", .at = format.time, .size = 8, .raw = number<double>, .unit = "s"});
    if (format.infrared != 0)
        all.push_back({"infrared", format.infrared, 2, number<std::uint16_t>});
    add_extra_bytes(header, all);
    std::vector<std::string> names;
    names.reserve(all.size());
    for (const LasMeasurement &measurement : all)
        names.push_back(measurement.name);
    make_distinct(names);
    for (std::size_t i = 0; i < all.size(); ++i)
        all[i].name = std::move(names[i]);
    return all;
}

std::string unused_bytes(const LasHeader &header, const std::vector<LasMeasurement> &measurements, ByteView bits) {
    Bytes left(bits.begin(), bits.end());
    for (const LasMeasurement &measurement : measurements)
        std::fill_n(left.begin() + static_cast<std::ptrdiff_t>(measurement.at), measurement.size, std::uint8_t{0});
    constexpr std::size_t kWave = 29;
    const auto is_there = [&](std::size_t at, std::size_t size) {
        const ByteView bytes = ByteView(left).subspan(at, size);
        return std::any_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte != 0; });
    };
    const PointFormat &format = *header.format;
    const bool has_waves = format.wave != 0 && is_there(format.wave, kWave);
    const bool has_extra = is_there(format.size, header.stride - format.size);
    return has_waves && has_extra ? "waveforms, extra bytes without a name"
           : has_waves            ? "waveforms"
           : has_extra            ? "extra bytes without a name"
                                  : "";
}

} // namespace pbm::build
