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
#include <sys/stat.h>
#include <unistd.h>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr int kPause = 100; // milliseconds, from one report of a file that is being written to the next

} // namespace

FileStamp stamp_of(const Descriptor &file) {
    struct stat status {};
    if (::fstat(file.number(), &status) != 0)
        return {};
    return {status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

FileWatch::FileWatch(const std::string &path)
    : path_(path), events_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)), stop_(::eventfd(0, EFD_CLOEXEC)) {
    if (!events_.ok())
        return;
    add(path);
    add_contents();
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

// Watches the file that has the name now.
void FileWatch::add_contents() { contents_ = ::inotify_add_watch(events_.number(), path_.c_str(), IN_MODIFY); }

// Takes all pending events. Returns the last change of the file.
FileChange FileWatch::take_events() {
    alignas(inotify_event) std::array<char, 4096> buffer{};
    FileChange change = FileChange::none;
    for (;;) {
        const ssize_t count = ::read(events_.number(), buffer.data(), buffer.size());
        if (count <= 0)
            return change;
        for (std::size_t at = 0; at < static_cast<std::size_t>(count);) {
            inotify_event event{};
            std::memcpy(&event, buffer.data() + at, sizeof event);
            const std::string name = event.len == 0 ? "" : buffer.data() + at + sizeof event;
            if (event.wd == contents_ && (event.mask & IN_MODIFY) != 0)
                change = FileChange::writing;
            if (std::find(names_.begin(), names_.end(), std::pair(event.wd, name)) != names_.end()) {
                change = FileChange::whole;
                add_contents();
            }
            at += sizeof event + event.len;
        }
    }
}

FileChange FileWatch::wait() {
    std::array<pollfd, 2> files{{{events_.number(), POLLIN, 0}, {stop_.number(), POLLIN, 0}}};
    if (last_ == FileChange::writing)
        static_cast<void>(::poll(&files[1], 1, kPause));
    for (;;) {
        if (::poll(files.data(), files.size(), -1) < 0 && errno != EINTR)
            return FileChange::none;
        if (files[1].revents != 0)
            return FileChange::none;
        last_ = files[0].revents != 0 ? take_events() : FileChange::none;
        if (last_ != FileChange::none)
            return last_;
    }
}

void FileWatch::stop() {
    const std::uint64_t one = 1;
    static_cast<void>(write_all(stop_.number(), {reinterpret_cast<const std::uint8_t *>(&one), sizeof one}));
}

} // namespace pbm
