#include "sources/depfile.h"

#include "pbm_scan/surface/refusal.h"

#include <algorithm>
#include <string_view>

namespace pbm::build {
namespace {

// Ninja has no escape for & ' * ? " ; | < > ` ^ and tabs: it would take the parts of such a name for files that are
// missing. Make has none for : ; | and =, which begin other statements (after != it runs a command), and expands * ? [
// to names of files. CMake's Makefiles have none for backslashes.
constexpr std::string_view kMisread = "&'*?\";|<>`^:\\=[";
// Make takes -l for a library and ~ for a home, what ends in ) for a member of an archive, and a blank before the end
// of a line for none.
constexpr std::string_view kMisreadFirst = "-~", kMisreadLast = ") ";
// A target with it is a pattern.
constexpr char kPattern = '%';

constexpr const char *kNeverThere = "pbm-build-missing";

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

// Without "./" before it, which Make strips.
std::string_view stripped(std::string_view name) {
    while (name.starts_with("./")) {
        name.remove_prefix(2);
        name.remove_prefix(std::min(name.find_first_not_of('/'), name.size()));
    }
    return name;
}

// ".PHONY", ".IGNORE": Make's own targets.
bool is_special_target(std::string_view name) {
    return name.starts_with('.') && name.size() > 1 &&
           std::all_of(name.begin() + 1, name.end(), [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; });
}

Status misread(const std::string &what) {
    return usage_error(
        what + " cannot stand in a dependency file, which Make, Ninja or CMake would misread; rename the file or its "
               "folder");
}

} // namespace

std::string depfile_text(const std::string &target, std::span<const std::string> files, bool is_always_due) {
    std::string text = escaped(target) + ":", rules;
    const auto add = [&](const std::string &file) {
        text += " \\\n  " + escaped(file);
        if (file.find(kPattern) == std::string::npos)
            rules += escaped(file) + ":\n";
    };
    for (const std::string &file : files)
        add(file);
    if (is_always_due)
        add(kNeverThere);
    return text + "\n" + rules;
}

Status check_depfile_name(const std::string &name) {
    for (const char c : name) {
        if (static_cast<unsigned char>(c) < ' ' || c == '\x7f')
            return misread("a name with a control character");
        if (kMisread.find(c) != std::string_view::npos)
            return misread(std::string("a name with ") + c);
    }
    const std::string_view plain = stripped(name);
    if (!plain.empty() && kMisreadFirst.find(plain.front()) != std::string_view::npos)
        return misread(std::string("a name with ") + plain.front() + " at its beginning");
    if (!plain.empty() && kMisreadLast.find(plain.back()) != std::string_view::npos)
        return misread("a name with " + (plain.back() == ' ' ? std::string("a blank") : std::string(1, plain.back())) +
                       " at its end");
    if (is_special_target(plain))
        return misread("a name of capital letters behind a full stop");
    return {};
}

Status check_depfile_target(const std::string &name) {
    return name.find(kPattern) == std::string::npos ? check_depfile_name(name)
                                                    : misread(std::string("an output with ") + kPattern);
}

} // namespace pbm::build
