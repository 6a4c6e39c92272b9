// The records of a compressed vector: packets, whose byte streams hold the values of one field each, packed by bits.
// Format: ASTM E2807-11, sections 9.3 to 9.5
#pragma once

#include "pbm_scan/e57/e57_scans.h"

#include <cstdint>
#include <functional>
#include <span>

namespace pbm::build {

struct E57Sink {
    // Values `first` and following of a field.
    std::function<void(const E57Field &field, std::uint64_t first, std::span<const double> values)> values;
    std::function<bool(const E57Field &field)> wants; // fields without a role whose values are called for
    std::function<void(double done)> progress;        // 0..1
};

// Compares the records of all scans with the size of the file. Scans that share bytes count each.
//
// errors  bad_input  more records than the file can hold
Status check_e57_records(const std::vector<E57Scan> &scans, const E57Pages &pages);

// Calls sink.values for every field that has a role or is wanted, `scan.records` values each. Takes memory for one
// packet. Returns whether there are more values than these.
//
// errors  bad_input  a packet contradicts itself, records are missing, a wrong checksum
Result<bool> read_e57_records(const E57Scan &scan, E57Pages &pages, const E57Sink &sink);

} // namespace pbm::build
