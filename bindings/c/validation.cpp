// Verdicts, with a callback for findings.
#include "validation.h"

#include "model.h"

#include "pbm_format/checking/validate.h"
#include "system/threads/cancellation.h"

#include <algorithm>
#include <string>

namespace pbm::c_api {
namespace {

Result<ValidationLevel> level_of(std::int32_t level) {
    switch (level) {
    case PBM_VALIDATE: return ValidationLevel::standard;
    case PBM_VALIDATE_QUICK: return ValidationLevel::quick;
    case PBM_VALIDATE_DEEP: return ValidationLevel::deep;
    default: return usage_error("validation.level is " + std::to_string(level) + ", which is none");
    }
}

std::int32_t severity_of(Severity severity) {
    return severity == Severity::error ? PBM_ERROR : severity == Severity::warning ? PBM_WARNING : PBM_INFO;
}

// Hands a finding to the callback. Names and remedies of the catalogue are literals, which end with a zero byte; rules
// are parts of one.
void hand_out(const Finding &finding, const pbm_validation &to) {
    const std::string rule(finding.rule), name(finding.entry->name), remedy(finding.entry->remedy);
    const pbm_finding given{.severity = severity_of(finding.entry->severity),
                            .code = static_cast<pbm_code>(exit_code(finding.code)),
                            .offset = finding.offset,
                            .name = name.c_str(),
                            .rule = rule.c_str(),
                            .section = finding.section.c_str(),
                            .message = finding.message.c_str(),
                            .remedy = remedy.c_str()};
    if (to.report(to.context, &given) != 0)
        throw Cancelled();
}

} // namespace

Status validate_bytes(pbm_validation *validation, const std::function<Result<ByteView>()> &read) {
    Result<pbm_validation> to = read_structure(validation, "validation");
    if (!to)
        return to.error();
    const Result<ValidationLevel> level = level_of(to->level);
    if (!level)
        return level.error();
    if (Status checked = check_threads(to->threads); !checked)
        return checked;
    const Result<ByteView> bytes = read();
    if (!bytes)
        return bytes.error();
    ValidateOptions options{.threads = to->threads, .level = *level, .least = Severity::info};
    if (to->max_findings > 0)
        options.max_findings = static_cast<std::size_t>(to->max_findings);
    const ValidationReport report = validate(*bytes, options);
    if (report.exit_code == exit_code(ErrorCode::memory))
        return report.findings.empty() ? out_of_memory()
                                       : Error{ErrorCode::memory, 0, report.findings.front().message, "system.memory"};
    to->verdict = static_cast<pbm_code>(report.exit_code);
    to->errors = report.errors;
    to->warnings = report.warnings;
    to->infos = report.infos;
    to->points = report.points;
    std::memcpy(static_cast<void *>(validation), &*to, to->struct_size);
    if (to->report != nullptr)
        for (const Finding &finding : report.findings)
            hand_out(finding, *to);
    return {};
}

} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

pbm_code pbm_validate_memory(const void *bytes, uint64_t size, pbm_validation *validation, pbm_error *error) {
    return guarded(error, [&]() -> Status {
        if (bytes == nullptr)
            return usage_error("bytes is null");
        HeldBytes held;
        return validate_bytes(validation, [&]() -> Result<ByteView> {
            held = aligned({static_cast<const std::uint8_t *>(bytes), static_cast<std::size_t>(size)});
            return held.bytes;
        });
    });
}
