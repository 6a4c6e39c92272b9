#include "system/files/file_state.h"

#include <sys/stat.h>

namespace pbm {
namespace {

constexpr std::chrono::minutes kSettles{1};

} // namespace

std::string file_state(const std::string &path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) != 0)
        return {};
    std::string text;
    for (const auto number :
         {static_cast<long long>(found.st_dev), static_cast<long long>(found.st_ino),
          static_cast<long long>(found.st_size), static_cast<long long>(found.st_mtim.tv_sec),
          static_cast<long long>(found.st_mtim.tv_nsec), static_cast<long long>(found.st_ctim.tv_sec),
          static_cast<long long>(found.st_ctim.tv_nsec)})
        text += std::to_string(number) + ' ';
    return text;
}

bool is_settled(const std::string &path, std::chrono::system_clock::time_point now) {
    struct stat found {};
    return ::stat(path.c_str(), &found) == 0 &&
           std::chrono::system_clock::from_time_t(found.st_ctim.tv_sec) + kSettles < now;
}

} // namespace pbm
