// Law: for any bytes with repaired hashes, `verify` and `validate` give the same verdict, and the first finding is the
// error of `verify`. Findings lie inside the file and agree with their total. Level `hashes` refuses no valid file.
#include "pbm_format/checking/validate.h"
#include "unit/support/file_editor.h"

#include <cstdlib>

namespace {

void require(bool law) {
    if (!law)
        std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    pbm::test::FileEditor editor(pbm::Bytes(data, data + size));
    editor.repair();
    const pbm::ByteView file = editor.bytes();
    const pbm::Status first = pbm::verify(file, {.threads = 1});
    const bool valid = first.ok();
    require(pbm::verify(file, {.threads = 1, .level = pbm::ValidationLevel::hashes}) || !valid);
    const pbm::ValidationReport report = pbm::validate(file, {.threads = 1});
    require(report.valid() == valid && report.total >= report.findings.size());
    require(report.valid() == report.findings.empty());
    require(valid ||
            (first.error().message == report.findings[0].message && first.error().offset == report.findings[0].offset));
    for (const pbm::Finding &finding : report.findings)
        require(finding.offset <= size && !finding.message.empty());
    return 0;
}
