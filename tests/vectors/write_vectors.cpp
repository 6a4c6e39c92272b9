// Rewrites format_spec/vectors. Run it when the layout changes, and review the changes of the table.
//   write_vectors format_spec/vectors
#include "invalid_files.h"

#include "pbm_format/checking/validate.h"
#include "system/files/file_replacement.h"

#include <cstdio>
#include <sstream>

namespace {

void add_row(std::ostream &table, const std::string &name, const pbm::Finding &finding) {
    table << name << ',' << finding.entry->name << ',' << finding.rule << ',' << pbm::to_string(finding.code) << ','
          << finding.offset << ",\"" << finding.message << "\"\n";
}

bool write_table(const std::string &path, const std::string &text) {
    return pbm::replace_file(path, {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()}).ok();
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 2)
        return std::fprintf(stderr, "usage: write_vectors FOLDER\n"), 1;
    const std::string folder = argv[1];
    bool ok = true;
    for (const pbm::test::ValidFile &file : pbm::test::valid_files())
        ok &= pbm::replace_file(folder + "/valid/" + file.name, file.bytes).ok();
    std::ostringstream table;
    table << "file,code,rule,kind,offset,message\n";
    for (const pbm::test::InvalidFile &file : pbm::test::invalid_files()) {
        ok &= pbm::replace_file(folder + "/invalid/" + file.name, file.bytes).ok();
        const pbm::ValidationReport report = pbm::validate(file.bytes, {.threads = 1});
        const std::string rule = file.name.substr(0, file.name.find('-'));
        if (report.valid() || report.findings[0].rule != rule) {
            std::fprintf(stderr, "%s: does not break its rule: %s\n", file.name.c_str(),
                         report.valid() ? "valid" : report.findings[0].message.c_str());
            ok = false;
            continue;
        }
        add_row(table, file.name, report.findings[0]);
    }
    ok &= write_table(folder + "/invalid/table.csv", table.str());

    table.str("file,code,rule,kind,offset,message\n");
    table.seekp(0, std::ios::end);
    for (const pbm::test::ValidFile &file : pbm::test::advised_files()) {
        ok &= pbm::replace_file(folder + "/advised/" + file.name, file.bytes).ok();
        const pbm::ValidationReport report = pbm::validate(file.bytes, {.threads = 1, .least = pbm::Severity::info});
        if (!report.valid() || report.findings.empty()) {
            std::fprintf(stderr, "%s: %s\n", file.name.c_str(),
                         report.valid() ? "nothing to say about it" : report.findings[0].message.c_str());
            ok = false;
            continue;
        }
        add_row(table, file.name, report.findings[0]);
    }
    ok &= write_table(folder + "/advised/table.csv", table.str());
    return ok ? 0 : 1;
}
