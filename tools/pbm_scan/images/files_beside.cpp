#include "pbm_scan/images/files_beside.h"

#include "system/files/file_names.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace pbm::build {
namespace {

namespace fs = std::filesystem;

fs::path slashed(std::string_view name) {
    std::string slashed(name);
    std::replace(slashed.begin(), slashed.end(), '\\', '/');
    return slashed;
}

bool is_file(const fs::path &path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored);
}

// The entry of `folder` with this name in any case; the first in the order of names if there are several.
std::optional<fs::path> entry_of(const fs::path &folder, const std::string &name) {
    const std::string lower_name = lower_case(name);
    std::optional<fs::path> found;
    std::error_code error;
    for (fs::directory_iterator each(folder.empty() ? "." : folder, error), end; !error && each != end;
         each.increment(error)) {
        const std::string entry = each->path().filename().string();
        if (lower_case(entry) == lower_name && (!found || entry < found->filename().string()))
            found = folder / entry;
    }
    return found;
}

std::optional<fs::path> in_any_case(fs::path folder, const fs::path &name) {
    for (const fs::path &part : name) {
        std::error_code ignored;
        if (part == "." || part == ".." || fs::exists(folder / part, ignored)) {
            folder /= part;
            continue;
        }
        const auto entry = entry_of(folder, part.string());
        if (!entry)
            return std::nullopt;
        folder = *entry;
    }
    return is_file(folder) ? std::optional(folder) : std::nullopt;
}

} // namespace

std::optional<std::string> find_beside(const std::string &scan, std::string_view name) {
    const fs::path folder = fs::path(scan).parent_path(), path = slashed(name);
    if (path.empty() || name.find('\0') != std::string_view::npos)
        return std::nullopt;
    if (is_file(folder / path))
        return (folder / path).string();
    if (path.is_relative())
        if (const auto found = in_any_case(folder, path))
            return found->string();
    if (const auto found = in_any_case(folder, path.filename()))
        return found->string();
    return std::nullopt;
}

NamedFile name_beside(const std::string &scan, std::string_view name) {
    return {std::string(name), find_beside(scan, name).value_or(""),
            (fs::path(scan).parent_path() / slashed(name)).string()};
}

} // namespace pbm::build
