#include "command_line/web_viewer.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <vector>

namespace pbm::command_line {

namespace fs = std::filesystem;

namespace {

// Empty if there is none.
std::string read_page(const fs::path &page) {
    std::ifstream file(page, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

bool is_foreign(const fs::path &page) {
    constexpr std::string_view kMark = "<meta name=\"generator\" content=\"pbm-render\">";
    std::error_code ignored;
    return fs::exists(page, ignored) && read_page(page).find(kMark) == std::string::npos;
}

// FNV-1a, Fowler, Noll, Vo: it finds edits, not forgeries.
std::string seal_of(std::string_view page) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const char c : page)
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string digits;
    for (int shift = 60; shift >= 0; shift -= 4)
        digits += kDigits[hash >> shift & 15];
    return "<!-- pbm-render " + digits + ": a page that is edited is left alone -->\n";
}

} // namespace

std::string sealed_page(const std::string &page) { return page + seal_of(page); }

bool is_edited_page(const std::string &folder) {
    const std::string page = read_page(fs::path(folder) / kPage);
    if (page.empty())
        return false;
    const std::size_t seal = page.rfind("<!-- pbm-render ");
    return seal == std::string::npos || page.substr(seal) != seal_of(page.substr(0, seal));
}

Result<std::string> find_web_viewer(const std::string &folder) {
    const fs::path page = fs::path(folder) / kPage;
    if (is_foreign(page))
        return Error{ErrorCode::io, 0,
                     page.string() + ": --page did not write this file, and leaves it alone; name another folder"};
    std::error_code ignored;
    const fs::path programs = fs::read_symlink("/proc/self/exe", ignored).parent_path();
    std::vector<fs::path> folders{programs / "../share/pbm/web", programs / "../../web/package"};
    if (const char *named = std::getenv("PBM_WEB"); named != nullptr && *named != '\0')
        folders = {named};
    for (const fs::path &viewer : folders)
        if (fs::is_regular_file(viewer / kPageFiles, ignored))
            return viewer.lexically_normal().string();
    return Error{ErrorCode::io, 0,
                 folders.front().lexically_normal().string() +
                     ": the viewer for web pages is not there; the package pbm-web installs it, "
                     "scripts/test_web.sh builds it, PBM_WEB names another folder"};
}

} // namespace pbm::command_line
