// Law: bytes whose hashes are made right, so that what is behind the hashes is reached, get the same verdict from
// Reader::open + verify_all and from validate; whose findings lie inside the file and agree with their total; what is
// stored in order (verify_stored) is a part of what is valid.
#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/reader.h"
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
    pbm::Result<pbm::Reader> reader = pbm::Reader::open(file);
    const bool stored = reader && reader->verify_stored();
    const bool valid = reader && reader->verify_all(1);
    require(stored || !valid);
    const pbm::ValidationReport report = pbm::validate(file, {.threads = 1});
    require(report.valid() == valid && report.total >= report.findings.size());
    require(report.valid() == report.findings.empty());
    for (const pbm::Finding &finding : report.findings)
        require(finding.offset <= size && !finding.message.empty());
    return 0;
}
