#include "command_line/web_viewer.h"

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

bool is_foreign(const fs::path &page) {
    constexpr std::string_view kMark = "<meta name=\"generator\" content=\"pbm-render\">";
    std::ifstream file(page, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    return file.is_open() && text.find(kMark) == std::string::npos;
}

} // namespace

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
