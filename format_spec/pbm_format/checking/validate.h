// The second reading of the law: everything that is wrong with a file, not only the first thing. BVG.md section 9.
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

// How much is read.
//
//   quick     header and section table: the front of the file only, milliseconds at any size
//   standard  every byte: all hashes, all structure, content_id
//   deep      also what the bytes should be: averages of the levels (7.1), means of the rasters (3.10.14); and advice,
//             which is no error: warnings and infos of the catalogue
enum class ValidationLevel : std::uint8_t { quick, standard, deep };
std::string_view to_string(ValidationLevel level);

struct Finding {
    ErrorCode code{};
    std::uint64_t offset = 0;              // in the file
    std::string section{};                 // "header", "table", "grid", "level 7 chunks", ...
    std::int64_t chunk = -1;               // number within the level, or -1
    std::string message{};                 // starts with the rule's number, if it has one
    const CatalogueEntry *entry = nullptr; // name, severity, what to do; never null in a report
    std::string_view rule{};               // of BVG.md: "4.2"; empty for advice
    std::int64_t tile = -1;                // number within the raster, or -1
    Value expected{}, actual{};
};

struct ValidateOptions;

struct ValidationReport {
    std::vector<Finding> findings; // as many as the options allow
    std::uint64_t total = 0;       // findings in all, but for those that were not wanted
    std::uint64_t errors = 0;      // of them
    std::uint64_t warnings = 0, infos = 0;
    std::uint64_t ignored = 0;         // findings that were not wanted
    std::vector<std::uint64_t> totals; // [kCatalogue.size()]: findings of each code
    int exit_code = 0;                 // of the gravest error: see exit_code() in error.h
    std::uint64_t points = 0;          // what was proven
    std::uint64_t chunks = 0;

    bool valid() const { return errors == 0; }

    // Counts a finding; whether there is room to keep it.
    bool count(const CatalogueEntry &entry, ErrorCode code, const ValidateOptions &options);
    // Counts a finding, and keeps it if there is room.
    void add(Finding finding, const ValidateOptions &options);
};

struct ValidateOptions {
    int threads = 0;
    std::size_t max_findings = 100;
    ValidationLevel level = ValidationLevel::deep;
    Severity least = Severity::error;             // deep: advice from this severity on is looked for
    std::size_t max_per_code = 1000000;           // findings kept of each code, so that one does not hide the others
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded streams; more is system.memory
    // Findings of codes for which this is false count as `ignored` only. Empty: all are wanted.
    std::function<bool(const CatalogueEntry &)> wanted{};
};

// What follows from a fault that was found is not told again: a section whose hash is broken may break any other rule.
//
// With level deep, agrees with Reader::open + Reader::verify_all on every input: valid() here iff both succeed.
// Where memory ends there is no verdict: one finding of system.memory, or none if there is no room even for that.
ValidationReport validate(ByteView file, const ValidateOptions &options = {});

} // namespace pbm
