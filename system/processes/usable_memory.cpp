#include "system/processes/usable_memory.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include <unistd.h>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

// The number in a file; kUnlimited if there is none, as in "max".
std::uint64_t number_in(const fs::path &file) {
    std::uint64_t number = 0;
    return std::ifstream(file) >> number ? number : kUnlimited;
}

} // namespace

std::uint64_t control_group_memory(const std::string &groups, const std::string &mounted) {
    std::uint64_t least = kUnlimited;
    std::istringstream lines(groups); // "number:controllers:/path"; version 2 names no controllers
    for (std::string number, controllers, path;
         std::getline(lines, number, ':') && std::getline(lines, controllers, ':') && std::getline(lines, path);) {
        const bool is_version_2 = controllers.empty();
        if (!is_version_2 && ("," + controllers + ",").find(",memory,") == std::string::npos)
            continue;
        const fs::path root = is_version_2 ? fs::path(mounted) : fs::path(mounted) / "memory";
        const char *const limit = is_version_2 ? "memory.max" : "memory.limit_in_bytes";
        // In a container the path may be that of the host, which is not mounted; the container's group is then the
        // root.
        for (fs::path group = fs::path(path).relative_path();; group = group.parent_path()) {
            least = std::min(least, number_in(root / group / limit));
            if (group.empty())
                break;
        }
    }
    return least;
}

std::uint64_t usable_memory() {
    const auto physical =
        static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    std::ifstream file("/proc/self/cgroup");
    const std::string groups{std::istreambuf_iterator<char>(file), {}};
    return std::min(physical, control_group_memory(groups, "/sys/fs/cgroup"));
}

} // namespace pbm
