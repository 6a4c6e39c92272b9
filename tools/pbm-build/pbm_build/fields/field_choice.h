// The fields that a build keeps, and how their values become numbers of 8 or 16 bits. BVG.md 17
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// What --field says.
struct FieldRequest {
    std::string name;
    std::optional<std::array<double, 2>> range; // least < most; values outside are clamped
    std::optional<FieldAverage> average;
    std::optional<int> bits; // 8 or 16
};

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
// values the range is divided evenly. Of several inputs those without a field have no values of it.
//
// errors  usage      no input has one of the fields; the message lists those that there are
//         bad_input  no point has a finite value of a field, or its values are too far apart for a double
Result<std::vector<Field>> choose_fields(Surface &surface, std::span<const FieldRequest> requests,
                                         BuildStatistics &statistics);

std::vector<FieldSamples> field_samples(const Surface &surface, std::span<const Field> fields);

} // namespace pbm::build
