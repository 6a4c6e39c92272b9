#include "system/files/file_replacement.h"

#include "system/files/descriptor.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <optional>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pbm {

namespace {

std::string folder_of(const std::string &path) {
    const std::size_t slash = path.find_last_of('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

// The descriptor of this process that `path` stands for: /dev/stdout and the like, "-" for standard output. Opening
// such a name again would start at the beginning of a file that others append to, or fail if only this process may
// write. Replacing its target would break the name for everybody.
std::optional<int> open_file_of(const std::string &path) {
    if (path == "-" || path == "/dev/stdout")
        return STDOUT_FILENO;
    if (path == "/dev/stderr")
        return STDERR_FILENO;
    for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
        if (!path.starts_with(folder))
            continue;
        int number = 0;
        const char *const end = path.data() + path.size();
        const auto [stop, failure] = std::from_chars(path.data() + folder.size(), end, number);
        if (failure == std::errc() && stop == end)
            return number;
    }
    return std::nullopt;
}

// Follows a chain of links to its end, which may not exist: the file that is replaced while the links stay.
Result<std::string> follow_links(std::string path) {
    constexpr int kMaxLinks = 40;
    std::array<char, PATH_MAX> text{};
    for (int i = 0; i < kMaxLinks; ++i) {
        const ssize_t length = ::readlink(path.c_str(), text.data(), text.size());
        if (length < 0)
            return path; // not a link, or missing
        const std::string_view next(text.data(), static_cast<std::size_t>(length));
        path = next.starts_with('/') ? std::string() : folder_of(path) + '/';
        path += next;
    }
    return io_error("cannot write", ELOOP);
}

} // namespace

Status check_replaceable(const std::string &path) {
    if (const auto number = open_file_of(path))
        return ::fcntl(*number, F_GETFD) >= 0 ? Status() : io_error("cannot write", errno);
    const Result<std::string> target = follow_links(path);
    if (!target)
        return target.error();
    struct stat status {};
    if (::stat(target->c_str(), &status) == 0) {
        if (S_ISDIR(status.st_mode))
            return Error{ErrorCode::io, 0, "cannot write: this is a folder"};
        if (!S_ISREG(status.st_mode))
            return {};
    }
    const std::string folder = folder_of(*target);
    if (::stat(folder.c_str(), &status) != 0)
        return io_error("cannot write into " + folder, errno);
    if (!S_ISDIR(status.st_mode))
        return io_error("cannot write into " + folder, ENOTDIR);
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        return io_error("cannot write into " + folder, errno);
    return {};
}

namespace {

std::string base_of(const std::string &path) { return path.substr(path.find_last_of('/') + 1); }

// Whether the open file `number` is still `name` in `folder`, a regular file of this user without other names.
bool is_own_file(int folder, const std::string &name, int number) {
    struct stat held {
    }, named{};
    return ::fstat(number, &held) == 0 && ::fstatat(folder, name.c_str(), &named, AT_SYMLINK_NOFOLLOW) == 0 &&
           held.st_dev == named.st_dev && held.st_ino == named.st_ino && S_ISREG(held.st_mode) && held.st_nlink == 1 &&
           held.st_uid == ::geteuid();
}

// Locks a file that a killed writer left. Not ok() (see errno) if another process holds it or it is no sibling of ours.
Descriptor take_stale(int folder, const std::string &name) {
    Descriptor file(::openat(folder, name.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (!file.ok())
        return file;
    // The file may have become the target meanwhile, so check the name under the lock.
    if (::flock(file.number(), LOCK_EX | LOCK_NB) == 0 && is_own_file(folder, name, file.number()))
        return file;
    static_cast<void>(file.close());
    errno = EEXIST;
    return file;
}

// Creates or takes over an empty sibling that only this process writes; returns it with its name. The lock lasts as
// long as this process; on file systems without locks there is no protection.
Result<std::pair<Descriptor, std::string>> open_sibling(int folder, const std::string &base) {
    constexpr int kMaxWriters = 99;       // of one file at once
    constexpr std::size_t kMaxEnding = 7; // ".pbm-99"
    const std::string stem = base.substr(0, std::min(base.size(), NAME_MAX - kMaxEnding));
    const auto numbered = [&](int i) { return stem + ".pbm-" + std::to_string(i); };
    for (int i = 1; i <= kMaxWriters; ++i) {
        std::string name = numbered(i);
        Descriptor file(::openat(folder, name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
        if (!file.ok() && errno != EEXIST)
            return io_error("cannot write", errno);
        if (file.ok() && ::flock(file.number(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
            continue; // another process was quicker and has locked it as stale
        if (!file.ok()) {
            file = take_stale(folder, name);
            if (!file.ok() || ::ftruncate(file.number(), 0) != 0)
                continue;
        }
        for (int next = i + 1; next <= kMaxWriters; ++next) {
            const Descriptor stale = take_stale(folder, numbered(next));
            if (!stale.ok() && errno == ENOENT)
                break;
            if (stale.ok())
                ::unlinkat(folder, numbered(next).c_str(), 0);
        }
        return std::pair(std::move(file), std::move(name));
    }
    return Error{ErrorCode::io, 0, "cannot write: " + numbered(1) + " to -99 are in use or belong to another user"};
}

} // namespace

FileReplacement::FileReplacement(FileReplacement &&other) noexcept
    : file_(std::exchange(other.file_, -1)), folder_(std::exchange(other.folder_, -1)),
      target_(std::move(other.target_)), sibling_(std::exchange(other.sibling_, {})), mode_(other.mode_),
      owner_(other.owner_), group_(other.group_) {}

FileReplacement::~FileReplacement() {
    if (!sibling_.empty()) // unlink before closing releases the lock
        ::unlinkat(folder_, base_of(sibling_).c_str(), 0);
    if (file_ >= 0)
        ::close(file_);
    if (folder_ >= 0)
        ::close(folder_);
}

Result<FileReplacement> FileReplacement::begin(const std::string &path) {
    FileReplacement file;
    if (Status status = check_replaceable(path); !status)
        return status.error();
    if (const auto number = open_file_of(path)) {
        file.target_ = path;
        file.file_ = ::fcntl(*number, F_DUPFD_CLOEXEC, 0);
        return file.file_ >= 0 ? Result<FileReplacement>(std::move(file)) : io_error("cannot write", errno);
    }
    Result<std::string> target = follow_links(path);
    if (!target)
        return target.error();
    file.target_ = std::move(*target);
    struct stat old {};
    const bool exists = ::stat(file.target_.c_str(), &old) == 0;
    if (exists && !S_ISREG(old.st_mode)) {
        file.file_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
        return file.file_ >= 0 ? Result<FileReplacement>(std::move(file)) : io_error("cannot write", errno);
    }
    const std::string folder = folder_of(file.target_);
    file.folder_ = ::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (file.folder_ < 0)
        return io_error("cannot write into " + folder, errno);
    auto sibling = open_sibling(file.folder_, base_of(file.target_));
    if (!sibling)
        return sibling.error();
    file.file_ = sibling->first.release();
    file.sibling_ = folder + '/' + sibling->second;
    const mode_t mask = ::umask(0);
    ::umask(mask);
    file.mode_ = exists ? old.st_mode & 07777 : 0666 & ~mask;
    if (exists) {
        file.owner_ = old.st_uid;
        file.group_ = old.st_gid;
    }
    return file;
}

Status FileReplacement::write(ByteView bytes) {
    const int error = write_all(file_, bytes);
    return error == 0 ? Status() : io_error("cannot write", error);
}

Status FileReplacement::overwrite(std::uint64_t offset, ByteView bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
        if (written < 0 && errno != EINTR)
            return io_error("cannot write", errno);
        const auto done = static_cast<std::size_t>(std::max<ssize_t>(written, 0));
        offset += done;
        bytes = bytes.subspan(done);
    }
    return {};
}

namespace {

int sync(int file) {
    int result = 0;
    while ((result = ::fsync(file)) != 0 && errno == EINTR) {
    }
    return result;
}

} // namespace

Status FileReplacement::finish(Durability durability) {
    const bool synced = durability == Durability::synced;
    if (sibling_.empty())
        return ::close(std::exchange(file_, -1)) == 0 ? Status() : io_error("cannot write", errno);
    // Only root may give files away. Others keep the group where they belong to it. The mode comes last: a new owner
    // clears bits of it.
    if (::fchown(file_, owner_, group_) != 0)
        static_cast<void>(::fchown(file_, kUnchanged, group_) == 0);
    if (::fchmod(file_, mode_) != 0 || (synced && sync(file_) != 0))
        return io_error("cannot write", errno);
    // Some file systems report a full disk only when a descriptor is closed, so close a duplicate. The file itself
    // stays open: its lock must last until the rename.
    Descriptor duplicate(::fcntl(file_, F_DUPFD_CLOEXEC, 0));
    if (!duplicate.ok() || duplicate.close() != 0)
        return io_error("cannot write", errno);
    struct stat held {
    }, named{};
    const std::string folder = folder_of(target_);
    if (::fstat(folder_, &held) != 0 || ::stat(folder.c_str(), &named) != 0)
        return io_error("cannot write into " + folder, errno);
    if (held.st_dev != named.st_dev || held.st_ino != named.st_ino)
        return io_error("cannot write into " + folder, ENOENT); // another folder has its name now
    if (::renameat(folder_, base_of(sibling_).c_str(), folder_, base_of(target_).c_str()) != 0)
        return io_error("cannot write", errno);
    sibling_.clear();
    if (!synced)
        return {};
    // The rename survives a power cut only after the folder is synced; some file systems do not support that.
    const Descriptor readable(::openat(folder_, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (readable.ok())
        static_cast<void>(sync(readable.number()));
    return {};
}

Status replace_file(const std::string &path, ByteView bytes, Durability durability) {
    Result<FileReplacement> file = FileReplacement::begin(path);
    if (!file)
        return file.error();
    if (Status written = file->write(bytes); !written)
        return written;
    return file->finish(durability);
}

} // namespace pbm
