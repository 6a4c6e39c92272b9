#include "system/files/descriptor.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace pbm {

int Descriptor::close() { return number_ < 0 ? 0 : ::close(std::exchange(number_, -1)); }

Descriptor open_to_read(const std::string &path) {
    return Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
}

Descriptor open_to_append(const std::string &path) {
    constexpr int kFlags = O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC;
    Descriptor file(::open(path.c_str(), kFlags | O_NONBLOCK, 0666));
    if (file.ok())
        ::fcntl(file.number(), F_SETFL, O_APPEND);
    return file;
}

int write_all(int file, ByteView bytes) {
    constexpr std::size_t kMaxAtOnce = std::size_t{1} << 30;
    while (!bytes.empty()) {
        const ssize_t written = ::write(file, bytes.data(), std::min(bytes.size(), kMaxAtOnce));
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return written < 0 ? errno : ENOSPC;
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return 0;
}

Error io_error(const std::string &what, int number) {
    const ErrorCode code = number == ENOMEM ? ErrorCode::memory : ErrorCode::io;
    return {code, 0, what + ": " + std::generic_category().message(number)};
}

} // namespace pbm
