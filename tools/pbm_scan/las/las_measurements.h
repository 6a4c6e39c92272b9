// The measurements of the points of a LAS file that can be fields: those of the point format, and extra bytes that the
// file describes.
// Based on: ASPRS. LAS Specification 1.4 - R15. 2019, tables 7, 16 and 24
#pragma once

#include "pbm_scan/las/las_header.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

struct LasMeasurement {
    std::string name;
    std::size_t at, size; // in the record
    double (*raw)(const std::uint8_t *bytes);
    double scale = 1, offset = 0;
    std::optional<double> missing{}; // raw value of points without one
    const char *unit = "";

    // NaN: the point has none.
    double value(const std::uint8_t *record) const;
};

// In the order of the record, with different names. An array of extra bytes has a name for each element: "flow0",
// "flow1".
std::vector<LasMeasurement> las_measurements(const LasHeader &header);

// Names what the record holds besides: waveforms, extra bytes without a name; empty: nothing. `bits`: of the record,
// those set in any point.
std::string unused_bytes(const LasHeader &header, const std::vector<LasMeasurement> &measurements, ByteView bits);

} // namespace pbm::build
