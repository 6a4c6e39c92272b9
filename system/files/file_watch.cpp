#include "system/files/file_watch.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

namespace pbm {

namespace fs = std::filesystem;

FileWatch::FileWatch(const std::string &path)
    : events_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)), stop_(::eventfd(0, EFD_CLOEXEC)) {
    if (!events_.ok())
        return;
    add(path);
    std::error_code error;
    if (const fs::path target = fs::canonical(path, error); !error)
        add(target.string());
}

void FileWatch::add(const std::string &path) {
    const fs::path folder = fs::path(path).parent_path();
    const int watch = ::inotify_add_watch(events_.number(), folder.empty() ? "." : folder.c_str(),
                                          IN_CLOSE_WRITE | IN_MOVED_TO | IN_ONLYDIR);
    if (watch >= 0)
        names_.emplace_back(watch, fs::path(path).filename().string());
}

// Takes all pending events. Returns whether one was of the file.
bool FileWatch::take_events() {
    alignas(inotify_event) std::array<char, 4096> buffer{};
    bool changed = false;
    for (;;) {
        const ssize_t count = ::read(events_.number(), buffer.data(), buffer.size());
        if (count <= 0)
            return changed;
        for (std::size_t at = 0; at < static_cast<std::size_t>(count);) {
            inotify_event event{};
            std::memcpy(&event, buffer.data() + at, sizeof event);
            const std::string name = event.len == 0 ? "" : buffer.data() + at + sizeof event;
            changed = changed || std::find(names_.begin(), names_.end(), std::pair(event.wd, name)) != names_.end();
            at += sizeof event + event.len;
        }
    }
}

bool FileWatch::wait() {
    std::array<pollfd, 2> files{{{events_.number(), POLLIN, 0}, {stop_.number(), POLLIN, 0}}};
    for (;;) {
        if (::poll(files.data(), files.size(), -1) < 0 && errno != EINTR)
            return false;
        if (files[1].revents != 0)
            return false;
        if (files[0].revents != 0 && take_events())
            return true;
    }
}

void FileWatch::stop() {
    const std::uint64_t one = 1;
    static_cast<void>(write_all(stop_.number(), {reinterpret_cast<const std::uint8_t *>(&one), sizeof one}));
}

} // namespace pbm
