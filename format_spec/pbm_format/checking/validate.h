// Checks a file against every rule of BVG.md: `verify` returns the first error, `validate` reports all. Both are the
// same walk over the file (file_walk.h), so they agree on every file. BVG.md 9.
//
//   if (const Status status = verify(bytes); !status) ...    for writers and tests
//   const ValidationReport report = validate(bytes);         what pbm-validate prints
// Stability: stable.
#pragma once

#include "pbm_format/law/catalogue.h"
#include "pbm_format/reading/reader.h"
#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pbm {

// How much is checked. Each level includes the one before.
//
//   quick     header and section table: reads the front of the file only, milliseconds at any size
//   hashes    padding and the hashes of all sections: every byte is as written. Decodes nothing
//   standard  every rule of chunks, tiles and octree, and content_id. Decodes the whole model, a few chunks at a time
//   deep      averages of the levels (7.1), means of the rasters (3.10.14), and advice: warnings and infos
enum class ValidationLevel : std::uint8_t { quick, hashes, standard, deep };
std::string_view to_string(ValidationLevel level);

struct Finding {
    ErrorCode code{};
    std::uint64_t offset = 0;              // in the file
    std::string section{};                 // "header", "table", "grid", "level 7 chunks", ...
    std::int64_t chunk = -1;               // number within the level, or -1
    std::string message{};                 // starts with the rule's number, if any
    const CatalogueEntry *entry = nullptr; // name, severity, advice; never null in a report
    std::string_view rule{};               // of BVG.md: "4.2"; empty for advice
    std::int64_t tile = -1;                // number within the raster, or -1
    Value expected{}, actual{};
};

struct ValidateOptions;

struct ValidationReport {
    std::vector<Finding> findings; // limited by the options
    std::uint64_t total = 0;       // all wanted findings
    std::uint64_t errors = 0;      // of `total`
    std::uint64_t warnings = 0, infos = 0;
    std::uint64_t ignored = 0;         // unwanted findings
    std::vector<std::uint64_t> totals; // [kCatalogue.size()]: wanted findings of each code
    int exit_code = 0;                 // of the gravest error, see exit_code() in error.h
    std::uint64_t points = 0;          // verified
    std::uint64_t chunks = 0;

    bool valid() const { return errors == 0; }

    // Counts a finding. Returns whether there is room to keep it.
    bool count(const CatalogueEntry &entry, ErrorCode code, const ValidateOptions &options);
    // Counts a finding, and keeps it if there is room.
    void add(Finding finding, const ValidateOptions &options);
};

struct ValidateOptions {
    int threads = 0;
    std::size_t max_findings = 100;
    ValidationLevel level = ValidationLevel::deep;
    Severity least = Severity::error;   // deep: looks for advice of this severity and above
    std::size_t max_per_code = 1000000; // findings kept per code, so that one code does not hide others
    // Bytes besides those of the file: directories, decoded chunks and rasters, sums of hashes. The verdict does not
    // depend on it; if it does not suffice, a finding of system.memory says how much is needed.
    std::uint64_t max_memory = kDefaultMaxMemory;
    // Codes for which this returns false only count as `ignored`. Empty: all are wanted.
    std::function<bool(const CatalogueEntry &)> wanted{};
};

// Does not report consequences of a reported fault: a section whose hash does not match may break any other rule. If
// memory runs out there is no verdict, but one finding of system.memory, or none if memory does not suffice for that.
ValidationReport validate(ByteView file, const ValidateOptions &options = {});

struct VerifyOptions {
    int threads = 0;
    ValidationLevel level = ValidationLevel::deep;
    std::uint64_t max_memory = kDefaultMaxMemory; // as in ValidateOptions; the error system.memory if it is too little
};

// Returns the first error that `validate` would report; ErrorCode::memory if an allocation fails.
Status verify(ByteView file, const VerifyOptions &options = {});

} // namespace pbm
