#include "pbm_format/platform.h"

#include "pbm_format/catalogue.h"
#include "pbm_format/descriptor.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pbm {

namespace {

std::string folder_of(const std::string &path) {
    const std::size_t slash = path.find_last_of('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

} // namespace

namespace {

// The number of an open file of this process that `path` stands for: /dev/stdout and its like, "-" for standard output.
// Opening such a name anew would start at the beginning of a file that others append to, or fail where only this
// process may write; replacing what it names would break the name for everybody.
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

// Where a chain of links ends, whether or not there is something: the file that is replaced while the links stay.
Result<std::string> follow_links(std::string path) {
    constexpr int kMostLinks = 40;
    std::array<char, PATH_MAX> text{};
    for (int i = 0; i < kMostLinks; ++i) {
        const ssize_t length = ::readlink(path.c_str(), text.data(), text.size());
        if (length < 0)
            return path; // no link, or not there
        const std::string_view next(text.data(), static_cast<std::size_t>(length));
        path = next.starts_with('/') ? std::string() : folder_of(path) + '/';
        path += next;
    }
    return io_error("cannot write", ELOOP);
}

Error cannot_open(int number) {
    const Error error = io_error("cannot open", number);
    return error.code == ErrorCode::io ? broken("io.open", 0, error.message) : error;
}

} // namespace

Result<MappedFile> MappedFile::open(const std::string &path) {
    if (path == "-")
        return broken("io.not_a_file", 0, "standard input cannot be read here; write it to a file first");
    // O_NONBLOCK: a pipe without a writer is refused below instead of waited for.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file.ok())
        return cannot_open(errno);
    struct stat status {};
    if (::fstat(file.number(), &status) != 0)
        return io_error("cannot read", errno);
    if (S_ISDIR(status.st_mode))
        return broken("io.not_a_file", 0, "cannot open: this is a folder");
    if (!S_ISREG(status.st_mode))
        return broken("io.not_a_file", 0, "cannot open: not a regular file; write what it sends to a file first");
    const auto size = static_cast<std::size_t>(status.st_size);
    if (size == 0)
        return MappedFile(nullptr, 0);
    void *data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.number(), 0);
    if (data == MAP_FAILED)
        return io_error("cannot map", errno);
    return MappedFile(static_cast<const std::uint8_t *>(data), size);
}

bool is_stream(const std::string &path) {
    struct stat status {};
    return path == "-" || (::stat(path.c_str(), &status) == 0 &&
                           (S_ISFIFO(status.st_mode) || S_ISCHR(status.st_mode) || S_ISSOCK(status.st_mode)));
}

Result<MappedFile> MappedFile::read_stream(const std::string &path, std::uint64_t max_bytes,
                                           const std::function<std::uint64_t(ByteView)> &wanted) {
    constexpr std::size_t kFirst = std::size_t{1} << 20, kMostAtOnce = std::size_t{1} << 30;
    const Descriptor file(path == "-" ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file.ok())
        return cannot_open(errno);
    if (::isatty(file.number()) == 1)
        return broken("io.not_a_file", 0, "cannot read: this is a terminal; name a file, or send one through a pipe");
    const auto too_long = [&] {
        return Error{ErrorCode::memory, 0,
                     "more than " + std::to_string(max_bytes >> 20) + " MiB from a stream; write it to a file first"};
    };
    bool seen = false; // another byte than zero, among the first
    std::size_t room = kFirst, size = 0;
    std::uint64_t most = ~std::uint64_t{0};
    void *data = ::mmap(nullptr, room, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (data == MAP_FAILED)
        return Error{ErrorCode::memory, 0, "out of memory"};
    for (;;) {
        if (size == room) {
            void *const larger = ::mremap(data, room, 2 * room, MREMAP_MAYMOVE);
            if (larger == MAP_FAILED) {
                ::munmap(data, room);
                return Error{ErrorCode::memory, 0, "out of memory"};
            }
            data = larger;
            room *= 2;
        }
        const ssize_t got =
            ::read(file.number(), static_cast<std::uint8_t *>(data) + size, std::min(room - size, kMostAtOnce));
        if (got < 0 && errno == EINTR)
            continue;
        const bool started = size >= kStreamStart;
        if (got > 0)
            size += static_cast<std::size_t>(got);
        if (!wanted && !seen && size >= kFirst) {
            const auto *const first = static_cast<const std::uint8_t *>(data);
            seen = std::any_of(first, first + kFirst, [](std::uint8_t byte) { return byte != 0; });
            if (!seen) {
                ::munmap(data, room);
                return Error{ErrorCode::bad_input, 0, "cannot read: a stream of nothing but zero bytes"};
            }
        }
        if (wanted && !started && size >= kStreamStart)
            most = wanted({static_cast<const std::uint8_t *>(data), size});
        if (got > 0 && size <= max_bytes && size < most)
            continue;
        const int error = got < 0 ? errno : 0;
        if ((got == 0 && size > 0) || size >= most) {
            // Whole pages: what is beyond the last one goes back.
            const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
            const std::size_t kept = (size + page - 1) / page * page;
            if (kept < room)
                ::munmap(static_cast<std::uint8_t *>(data) + kept, room - kept);
            return MappedFile(static_cast<const std::uint8_t *>(data), size);
        }
        ::munmap(data, room);
        if (error != 0)
            return io_error("cannot read", error);
        return got == 0 ? Result<MappedFile>(MappedFile(nullptr, 0)) : Result<MappedFile>(too_long());
    }
}

MappedFile::MappedFile(MappedFile &&other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

MappedFile &MappedFile::operator=(MappedFile &&other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
}

MappedFile::~MappedFile() {
    if (data_ != nullptr)
        ::munmap(const_cast<std::uint8_t *>(data_), size_);
}

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

// Whether the open file `number` is what `name` stands for in `folder`: a file of ours with no other name.
bool is_own_file(int folder, const std::string &name, int number) {
    struct stat held {
    }, named{};
    return ::fstat(number, &held) == 0 && ::fstatat(folder, name.c_str(), &named, AT_SYMLINK_NOFOLLOW) == 0 &&
           held.st_dev == named.st_dev && held.st_ino == named.st_ino && S_ISREG(held.st_mode) && held.st_nlink == 1 &&
           held.st_uid == ::geteuid();
}

// What a process left that was killed while it wrote: locked, or nothing (errno says why) if another one is at it, or
// it is nobody's sibling.
Descriptor take_stale(int folder, const std::string &name) {
    Descriptor file(::openat(folder, name.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (!file.ok())
        return file;
    // It may have become the target meanwhile, so the name is looked at under the lock.
    if (::flock(file.number(), LOCK_EX | LOCK_NB) == 0 && is_own_file(folder, name, file.number()))
        return file;
    static_cast<void>(file.close());
    errno = EEXIST;
    return file;
}

// A file that only this process writes, empty, and its name. The lock tells others, as long as this process lives; a
// file system without locks has none to tell.
Result<std::pair<Descriptor, std::string>> open_sibling(int folder, const std::string &base) {
    constexpr int kMostWriters = 99; // of one file at once
    const auto numbered = [&](int i) { return base + ".pbm-" + std::to_string(i); };
    for (int i = 1; i <= kMostWriters; ++i) {
        std::string name = numbered(i);
        Descriptor file(::openat(folder, name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
        if (!file.ok() && errno != EEXIST)
            return io_error("cannot write", errno);
        if (file.ok() && ::flock(file.number(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
            continue; // another process was quicker and has taken it for stale
        if (!file.ok()) {
            file = take_stale(folder, name);
            if (!file.ok() || ::ftruncate(file.number(), 0) != 0)
                continue;
        }
        for (int next = i + 1; next <= kMostWriters; ++next) {
            const Descriptor stale = take_stale(folder, numbered(next));
            if (!stale.ok() && errno == ENOENT)
                break;
            if (stale.ok())
                ::unlinkat(folder, numbered(next).c_str(), 0);
        }
        return std::pair(std::move(file), std::move(name));
    }
    return Error{ErrorCode::io, 0, "cannot write: " + numbered(1) + " and its like are in use or not ours"};
}

} // namespace

FileReplacement::FileReplacement(FileReplacement &&other) noexcept
    : file_(std::exchange(other.file_, -1)), folder_(std::exchange(other.folder_, -1)),
      target_(std::move(other.target_)), sibling_(std::exchange(other.sibling_, {})), mode_(other.mode_) {}

FileReplacement::~FileReplacement() {
    if (!sibling_.empty()) // before its lock ends with the file
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
    if (::fchmod(file_, mode_) != 0 || (synced && sync(file_) != 0))
        return io_error("cannot write", errno);
    // Some file systems tell only at the end of a descriptor that the disk is full; the file itself stays open, since
    // its lock must last until it has its name.
    if (::close(::fcntl(file_, F_DUPFD_CLOEXEC, 0)) != 0)
        return io_error("cannot write", errno);
    struct stat held {
    }, named{};
    const std::string folder = folder_of(target_);
    if (::fstat(folder_, &held) != 0 || ::stat(folder.c_str(), &named) != 0)
        return io_error("cannot write into " + folder, errno);
    if (held.st_dev != named.st_dev || held.st_ino != named.st_ino)
        return io_error("cannot write into " + folder, ENOENT); // another one has its name now
    if (::renameat(folder_, base_of(sibling_).c_str(), folder_, base_of(target_).c_str()) != 0)
        return io_error("cannot write", errno);
    sibling_.clear();
    if (!synced)
        return {};
    // The rename itself survives a power cut only when the folder reached the disk; some file systems cannot do it.
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

void make_write_errors_returns() {
    // A standard stream that is closed gets a number whose use fails, or the next file would be taken for it.
    for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(number, F_GETFD) < 0)
            static_cast<void>(::open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY));
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

namespace {

// What the handler says; only async-signal-safe calls are allowed in it.
std::array<char, 160> shrink_message{};

std::atomic_flag has_shrunk;

extern "C" void report_shrunk_file(int) {
    if (has_shrunk.test_and_set()) // another thread is about to end the program
        for (;;)
            ::pause();
    const ssize_t written = ::write(STDERR_FILENO, shrink_message.data(), ::strlen(shrink_message.data()));
    ::_exit(written < 0 ? 2 : exit_code(ErrorCode::io));
}

} // namespace

void end_when_mapped_file_shrinks(std::string_view program) {
    std::snprintf(shrink_message.data(), shrink_message.size(),
                  "%.*s: the file became shorter while it was read; wait until it is written and try again\n",
                  static_cast<int>(std::min<std::size_t>(program.size(), 40)), program.data());
    struct sigaction action {};
    action.sa_handler = report_shrunk_file;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(SIGBUS, &action, nullptr);
}

void use_large_pages() {
#ifdef __GLIBC__
    constexpr int kMostAtOnce = 32 << 20; // the largest threshold that there is
    constexpr int kHeap = 256 << 20;      // addresses, not memory
    ::mallopt(M_ARENA_MAX, 1);
    ::mallopt(M_MMAP_THRESHOLD, kMostAtOnce);
    ::mallopt(M_TRIM_THRESHOLD, kHeap);
    ::mallopt(M_TOP_PAD, kHeap);
    // The next block that the heap has no room for makes it grow.
    const std::unique_ptr<void, decltype(&std::free)> block(std::malloc(kMostAtOnce / 2), std::free);
    const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    const auto address = reinterpret_cast<std::uintptr_t>(block.get());
    const std::uintptr_t end = reinterpret_cast<std::uintptr_t>(::sbrk(0)), gap = (page - address % page) % page;
    // Elsewhere if the heap cannot grow.
    if (block != nullptr && address < end && end - address <= 2 * std::uintptr_t{kHeap})
        static_cast<void>(::madvise(static_cast<char *>(block.get()) + gap, end - address - gap, MADV_HUGEPAGE));
#endif
}

std::uint64_t peak_memory() {
    struct rusage usage {};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

} // namespace pbm
