// The fields that a build keeps, and how their values become numbers of 8 or 16 bits. BVG.md 17
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// What --field says.
struct FieldRequest {
    std::string name;
    std::optional<std::array<double, 2>> range; // least < most; values outside are clamped
    std::optional<FieldAverage> average;
    std::optional<int> bits; // 8 or 16
};

// Measurements of laser scans that a build keeps although nobody asks, where they vary: class, intensity and number of
// the return.
inline constexpr std::array<std::string_view, 3> kUsualFields{"classification", "intensity", "return_number"};
// Those that are not in `dropped`.
std::vector<std::string> usual_fields(std::span<const std::string> dropped);

// "NAME[=MIN,MAX][,mean|majority|max][,8|16]", the last two in any order.
Result<FieldRequest> parse_field(const std::string &text);

// A field of the model and its values at the vertices, as integers: exact sums do not depend on their order.
struct FieldSamples {
    static constexpr int kFraction = 15;             // bits behind the point
    static constexpr std::int32_t kNone = INT32_MIN; // no value
    FieldAverage average = FieldAverage::mean;
    std::vector<std::int32_t> values; // [positions] (stored value - 1) x 2^kFraction, or kNone
};

// Clamps the values of `surface` to the ranges of the requests. Whole numbers that fit are stored as they are; of other
// values the range is divided evenly. Of several inputs those without a field have no values of it. `usual`: fields
// that are kept behind those where the scan has them and their values are not all equal.
//
// errors  usage      no input has one of the fields; the message lists those that there are
//         bad_input  no point has a finite value of a field, or its values are too far apart for a double
Result<std::vector<Field>> choose_fields(Surface &surface, std::span<const FieldRequest> requests,
                                         std::span<const std::string> usual, BuildStatistics &statistics);

std::vector<FieldSamples> field_samples(const Surface &surface, std::span<const Field> fields);

} // namespace pbm::build
