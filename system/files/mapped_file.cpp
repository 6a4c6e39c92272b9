#include "system/files/mapped_file.h"

#include "system/files/descriptor.h"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pbm {

namespace {

Error cannot_open(int number) {
    Error error = io_error("cannot open", number);
    if (error.code == ErrorCode::io)
        error.name = "io.open";
    return error;
}

Error not_a_file(const char *text) { return {.code = ErrorCode::io, .message = text, .name = "io.not_a_file"}; }

} // namespace

Result<MappedFile> MappedFile::open(const std::string &path) {
    if (path == "-")
        return not_a_file("standard input cannot be read here; write it to a file first");
    const Descriptor file = open_to_read(path);
    if (!file.ok())
        return cannot_open(errno);
    struct stat status {};
    if (::fstat(file.number(), &status) != 0)
        return io_error("cannot read", errno);
    if (S_ISDIR(status.st_mode))
        return not_a_file("cannot open: this is a folder");
    if (!S_ISREG(status.st_mode))
        return not_a_file("cannot open: not a regular file; write what it sends to a file first");
    const auto size = static_cast<std::size_t>(status.st_size);
    if (size == 0)
        return MappedFile(nullptr, 0);
    void *data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.number(), 0);
    if (data == MAP_FAILED)
        return io_error("cannot map", errno);
    return MappedFile(static_cast<const std::uint8_t *>(data), size);
}

void MappedFile::read_sparsely() {
    if (data_ != nullptr)
        static_cast<void>(::madvise(const_cast<std::uint8_t *>(data_), size_, MADV_RANDOM));
}

void MappedFile::will_need(ByteView bytes) {
    const std::uintptr_t before =
        reinterpret_cast<std::uintptr_t>(bytes.data()) % static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    static_cast<void>(
        ::madvise(const_cast<std::uint8_t *>(bytes.data()) - before, bytes.size() + before, MADV_WILLNEED));
}

bool is_stream(const std::string &path) {
    struct stat status {};
    return path == "-" || (::stat(path.c_str(), &status) == 0 &&
                           (S_ISFIFO(status.st_mode) || S_ISCHR(status.st_mode) || S_ISSOCK(status.st_mode)));
}

Result<MappedFile> MappedFile::read_stream(const std::string &path, std::uint64_t max_bytes,
                                           const std::function<std::uint64_t(ByteView)> &wanted) {
    constexpr std::size_t kFirst = std::size_t{1} << 20, kMaxAtOnce = std::size_t{1} << 30;
    const Descriptor file(path == "-" ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file.ok())
        return cannot_open(errno);
    if (::isatty(file.number()) == 1)
        return not_a_file("cannot read: this is a terminal; name a file, or send one through a pipe");
    const auto too_long = [&] {
        return Error{ErrorCode::memory, 0,
                     "more than " + std::to_string(max_bytes >> 20) + " MiB from a stream; write it to a file first"};
    };
    bool seen = false; // whether the first bytes hold a nonzero one
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
            ::read(file.number(), static_cast<std::uint8_t *>(data) + size, std::min(room - size, kMaxAtOnce));
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
            // Unmap the pages behind the last one used.
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

} // namespace pbm
