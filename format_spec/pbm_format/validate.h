// The second reading of the law: everything that is wrong with a file, not only the first thing. BVG.md section 9.
#pragma once

#include "pbm_format/bytes.h"
#include "pbm_format/error.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pbm {

struct Finding {
    ErrorCode code{};
    std::uint64_t offset = 0; // in the file
    std::string section;      // "header", "table", "grid", "level 7 chunks", ...
    std::int64_t chunk = -1;  // index within the level, or -1
    std::string message;      // starts with the rule's number
};

struct ValidationReport {
    std::vector<Finding> findings; // in the order of the file; at most `max_findings`
    std::uint64_t total = 0;       // findings in all
    std::uint64_t points = 0;      // what was proven
    std::uint64_t chunks = 0;

    bool valid() const { return total == 0; }
};

struct ValidateOptions {
    int threads = 0;
    std::size_t max_findings = 100;
};

// Agrees with Reader::open + Reader::verify_all on every input: valid() here iff both succeed.
ValidationReport validate(ByteView file, const ValidateOptions &options = {});

} // namespace pbm
