#include "pbm_format/checking/validate.h"

#include "pbm_format/checking/file_walk.h"

#include <algorithm>
#include <new>

namespace pbm {

std::string_view to_string(ValidationLevel level) {
    switch (level) {
    case ValidationLevel::quick: return "quick";
    case ValidationLevel::hashes: return "hashes";
    case ValidationLevel::standard: return "standard";
    case ValidationLevel::deep: return "deep";
    }
    return "unknown";
}

bool ValidationReport::count(const CatalogueEntry &entry, ErrorCode code, const ValidateOptions &options) {
    if (options.wanted && !options.wanted(entry)) {
        ++ignored;
        return false;
    }
    totals.resize(kCatalogue.size());
    std::uint64_t &of_code = totals[static_cast<std::size_t>(&entry - kCatalogue.data())];
    ++total;
    ++of_code;
    switch (entry.severity) {
    case Severity::info: ++infos; break;
    case Severity::warning: ++warnings; break;
    case Severity::error:
        ++errors;
        exit_code = std::max(exit_code, pbm::exit_code(code));
        break;
    }
    return findings.size() < options.max_findings && of_code <= options.max_per_code;
}

void ValidationReport::add(Finding finding, const ValidateOptions &options) {
    if (count(*finding.entry, finding.code, options))
        findings.push_back(std::move(finding));
}

ValidationReport validate(ByteView file, const ValidateOptions &options) {
    ValidationReport no_verdict; // counts even if the code is ignored: nothing was verified
    no_verdict.total = no_verdict.errors = 1;
    no_verdict.exit_code = exit_code(ErrorCode::memory);
    try {
        const CatalogueEntry *entry = find_code("system.memory");
        no_verdict.totals.resize(kCatalogue.size());
        no_verdict.totals[static_cast<std::size_t>(entry - kCatalogue.data())] = 1;
        no_verdict.findings.push_back(
            {.code = ErrorCode::memory, .section = "file", .message = out_of_memory().message, .entry = entry});
        return walk_file(file, options, AfterError::go_on);
    } catch (const std::bad_alloc &) {
        return no_verdict;
    }
}

Status verify(ByteView file, const VerifyOptions &options) try {
    walk_file(file, {.threads = options.threads, .level = options.level, .max_memory = options.max_memory},
              AfterError::stop);
    return {};
} catch (Error &first) {
    return std::move(first);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

} // namespace pbm
