#include "system/files/file_state.h"

#include <sys/stat.h>

namespace pbm {

std::string file_state(const std::string &path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) != 0)
        return {};
    std::string text;
    for (const auto number : {static_cast<long long>(found.st_dev), static_cast<long long>(found.st_ino),
                              static_cast<long long>(found.st_size), static_cast<long long>(found.st_mtim.tv_sec),
                              static_cast<long long>(found.st_mtim.tv_nsec)})
        text += std::to_string(number) + ' ';
    return text;
}

} // namespace pbm
