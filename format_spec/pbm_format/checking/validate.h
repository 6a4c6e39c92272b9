// Whether a file keeps every rule of BVG.md: `verify` returns the first error, `validate` reports all of them. Both are
// the same walk over the file (file_walk.h), so that they agree on every file. BVG.md section 9.
//
//   if (const Status status = verify(bytes); !status) ...    a writer's proof, a test
//   const ValidationReport report = validate(bytes);         what pbm-validate prints
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

// How much is checked. Each level checks what the one before does, and more.
//
//   quick     header and section table: reads the front of the file only, milliseconds at any size
//   hashes    every byte is as it was written: padding and the hashes of all sections. Decodes nothing
//   standard  every rule that a chunk, a tile or the octree can break, and content_id. Decodes the whole model
//   deep      averages of the levels (7.1) and means of the rasters (3.10.14); and advice, which is no error: warnings
//             and infos of the catalogue
enum class ValidationLevel : std::uint8_t { quick, hashes, standard, deep };
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
    std::uint64_t points = 0;          // what was verified
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

// Does not report what follows from a fault that was reported: a section whose hash does not match may break any other
// rule. When memory runs out there is no verdict: one finding of system.memory, or none if there is no memory for that.
ValidationReport validate(ByteView file, const ValidateOptions &options = {});

struct VerifyOptions {
    int threads = 0;
    ValidationLevel level = ValidationLevel::deep;
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded streams; more is system.memory
};

// The first error that `validate` would report; ErrorCode::memory also when an allocation fails. With several threads,
// of several bad chunks of one level it may be any.
Status verify(ByteView file, const VerifyOptions &options = {});

} // namespace pbm
