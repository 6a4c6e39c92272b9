#include "viewer/opening/recent_files.h"

#include "system/files/file_names.h"
#include "system/files/file_replacement.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace pbm {

namespace fs = std::filesystem;

std::string RecentFiles::default_file() {
    const std::string folder = xdg_folder("XDG_STATE_HOME", ".local/state", "pbm");
    return folder.empty() ? "" : (fs::path(folder) / "recent").string();
}

std::vector<std::string> RecentFiles::read() const {
    std::vector<std::string> paths;
    std::ifstream in(file_);
    for (std::string line; paths.size() < kMax && std::getline(in, line);)
        if (fs::path(line).is_absolute())
            paths.push_back(line);
    return paths;
}

std::vector<std::string> RecentFiles::list() const {
    std::vector<std::string> paths = read();
    std::erase_if(paths, [](const std::string &path) {
        std::error_code ignored;
        return !fs::is_regular_file(path, ignored);
    });
    return paths;
}

void RecentFiles::add(const std::string &path) const {
    std::error_code error;
    const std::string full = fs::absolute(path, error).lexically_normal().string();
    if (file_.empty() || error || full.find('\n') != std::string::npos)
        return;
    std::vector<std::string> paths = read();
    if (!paths.empty() && paths.front() == full)
        return;
    std::erase(paths, full);
    std::string text = full + '\n';
    for (std::size_t i = 0; i < paths.size() && i + 1 < kMax; ++i)
        text += paths[i] + '\n';
    fs::create_directories(fs::path(file_).parent_path(), error);
    static_cast<void>(replace_file(file_, as_bytes(text), Durability::cached));
}

} // namespace pbm
