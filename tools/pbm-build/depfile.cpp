#include "depfile.h"

#include "pbm_scan/surface/refusal.h"

namespace pbm::build {
namespace {

std::string escaped(const std::string &name) {
    std::string out;
    std::size_t backslashes = 0; // before the current character
    for (const char c : name) {
        if (c == ' ' || c == '\t')
            out.append(backslashes + 1, '\\');
        else if (c == '#')
            out += '\\';
        else if (c == '$')
            out += '$';
        out += c;
        backslashes = c == '\\' ? backslashes + 1 : 0;
    }
    return out;
}

} // namespace

std::string depfile_text(const std::string &target, std::span<const std::string> files) {
    std::string text = escaped(target) + ":";
    for (const std::string &file : files)
        text += " \\\n  " + escaped(file);
    return text + "\n";
}

Status check_depfile_name(const std::string &name) {
    if (name.find_first_of("\r\n") != std::string::npos)
        return usage("a name with a line feed cannot stand in a dependency file; rename the file");
    if (name.ends_with('\\')) // it would escape the space that follows
        return usage("a name that ends with \\ cannot stand in a dependency file; rename the file");
    return {};
}

} // namespace pbm::build
