// Writes format_spec/vectors anew: run it when the layout changes, and look at what changed in the table.
//   write_vectors format_spec/vectors
#include "invalid_files.h"

#include "pbm_format/platform.h"
#include "pbm_format/validate.h"

#include <cstdio>
#include <sstream>

int main(int argc, char **argv) {
    if (argc != 2)
        return std::fprintf(stderr, "usage: write_vectors FOLDER\n"), 1;
    const std::string folder = argv[1];
    bool ok = true;
    for (const pbm::test::ValidFile &file : pbm::test::valid_files())
        ok &= pbm::replace_file(folder + "/valid/" + file.name, file.bytes).ok();
    std::ostringstream table;
    table << "file,code,offset,message\n";
    for (const pbm::test::InvalidFile &file : pbm::test::invalid_files()) {
        ok &= pbm::replace_file(folder + "/invalid/" + file.name, file.bytes).ok();
        const pbm::ValidationReport report = pbm::validate(file.bytes, {.threads = 1});
        const std::string rule = file.name.substr(0, file.name.find('-'));
        if (report.valid() || !report.findings[0].message.starts_with(rule + " ")) {
            std::fprintf(stderr, "%s: does not break its rule: %s\n", file.name.c_str(),
                         report.valid() ? "valid" : report.findings[0].message.c_str());
            ok = false;
            continue;
        }
        const pbm::Finding &finding = report.findings[0];
        table << file.name << ',' << pbm::to_string(finding.code) << ',' << finding.offset << ",\"" << finding.message
              << "\"\n";
    }
    const std::string text = table.str();
    ok &= pbm::replace_file(folder + "/invalid/table.csv",
                            {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()})
              .ok();
    return ok ? 0 : 1;
}
