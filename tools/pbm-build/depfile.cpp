#include "depfile.h"

#include "pbm_scan/surface/refusal.h"

#include <string_view>

namespace pbm::build {
namespace {

std::string escaped(const std::string &name) {
    std::string out;
    for (const char c : name) {
        if (c == ' ' || c == '#')
            out += '\\';
        else if (c == '$')
            out += '$';
        out += c;
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
    constexpr std::string_view kMisread = "&'*?\";|<>`^:\\";
    for (const char c : name) {
        const bool control = static_cast<unsigned char>(c) < ' ' || c == '\x7f';
        if (control || kMisread.find(c) != std::string_view::npos)
            return usage("a name with " + (control ? std::string("a control character") : std::string(1, c)) +
                         " cannot stand in a dependency file, which Make, Ninja or CMake would misread; rename the "
                         "file or its folder");
    }
    return {};
}

} // namespace pbm::build
