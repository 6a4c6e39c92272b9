// Preloaded library: makes the n-th system call of a program fail, or changes files just before it. Environment:
//
//   PBM_FAULT_LOG=FILE         appends the name of every call, in order
//   PBM_FAULT_CALL=NAME        counts and logs calls of this name only. Without it, all calls but madvise and
//                              sync_file_range, whose number differs from run to run
//   PBM_FAULT_AT=N             the affected call, counted from 1; a child continues its parent's count
//   PBM_FAULT_KIND=error       the call is not made and fails with PBM_FAULT_ERRNO
//                 =errors      so do all later ones
//                 =short       the call transfers half of its bytes, at least one
//                 =kill        the program is killed instead
//                 =move        PBM_FAULT_PATH is renamed to PBM_FAULT_TO before the call
//                 =remove      PBM_FAULT_PATH, a folder of files, is removed before the call
//                 =empty       PBM_FAULT_PATH, a file, is truncated to 0 bytes before the call
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

// Makes system calls directly, because this library replaces the functions of the C library.
void log_call(const char *name) {
    const char *const path = std::getenv("PBM_FAULT_LOG");
    if (path == nullptr)
        return;
    const long file = ::syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND, 0600);
    char line[32] = {};
    std::strncpy(line, name, sizeof line - 2);
    line[std::strlen(line)] = '\n';
    ::syscall(SYS_write, file, line, std::strlen(line));
    ::syscall(SYS_close, file);
}

void remove_folder(const char *path) {
    DIR *const folder = ::opendir(path);
    if (folder == nullptr)
        return;
    while (const dirent *entry = ::readdir(folder))
        ::syscall(SYS_unlinkat, ::dirfd(folder), entry->d_name, 0);
    ::closedir(folder);
    ::syscall(SYS_unlinkat, AT_FDCWD, path, AT_REMOVEDIR);
}

enum class Fate { made, failed, halved };

std::string_view text_of(const char *name) {
    const char *const text = std::getenv(name);
    return text == nullptr ? std::string_view() : text;
}

bool is_counted(std::string_view name) {
    const std::string_view only = text_of("PBM_FAULT_CALL");
    return only.empty() ? name != "madvise" && name != "sync_file_range" : name == only;
}

// Decides the fate of this call.
Fate next_call(const char *name) {
    static std::atomic<long> count{0};
    static const long at =
        std::strtol(text_of("PBM_FAULT_AT").empty() ? "0" : std::getenv("PBM_FAULT_AT"), nullptr, 10);
    if (!is_counted(name))
        return Fate::made;
    const long number = ++count;
    log_call(name);
    const std::string_view kind = text_of("PBM_FAULT_KIND");
    if (at == 0 || (kind == "errors" ? number < at : number != at))
        return Fate::made;
    const char *const path = std::getenv("PBM_FAULT_PATH");
    if (kind == "kill")
        ::syscall(SYS_kill, ::syscall(SYS_getpid), SIGKILL);
    else if (kind == "move")
        ::syscall(SYS_renameat2, AT_FDCWD, path, AT_FDCWD, std::getenv("PBM_FAULT_TO"), 0);
    else if (kind == "remove")
        remove_folder(path);
    else if (kind == "empty")
        ::syscall(SYS_truncate, path, 0);
    else if (kind == "short")
        return Fate::halved;
    else {
        errno = static_cast<int>(std::strtol(std::getenv("PBM_FAULT_ERRNO"), nullptr, 10));
        return Fate::failed;
    }
    return Fate::made;
}

template <class Function> Function *real(const char *name) {
    return reinterpret_cast<Function *>(::dlsym(RTLD_NEXT, name));
}

// Makes the call, or returns -1 and sets errno.
template <class Function, class... Arguments> auto call(const char *name, Arguments... arguments) {
    static Function *const next = real<Function>(name);
    using Value = decltype(next(arguments...));
    if (next_call(name) == Fate::failed)
        return static_cast<Value>(-1);
    return next(arguments...);
}

// The same for calls that transfer `size` bytes.
template <class Function, class Move> ssize_t transfer(const char *name, std::size_t size, Move &&move) {
    static Function *const next = real<Function>(name);
    switch (next_call(name)) {
    case Fate::failed: return -1;
    case Fate::halved: return move(next, size > 1 ? size / 2 : size);
    case Fate::made: break;
    }
    return move(next, size);
}

mode_t mode_of(int flags, va_list list) { return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(list, mode_t) : 0; }

} // namespace

extern "C" {

int open(const char *path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    const mode_t mode = mode_of(flags, list);
    va_end(list);
    return call<int(const char *, int, ...)>("open", path, flags, mode);
}
int open64(const char *path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    const mode_t mode = mode_of(flags, list);
    va_end(list);
    return call<int(const char *, int, ...)>("open", path, flags, mode);
}
int openat(int folder, const char *path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    const mode_t mode = mode_of(flags, list);
    va_end(list);
    return call<int(int, const char *, int, ...)>("openat", folder, path, flags, mode);
}
ssize_t read(int file, void *to, size_t size) {
    return transfer<ssize_t(int, void *, size_t)>("read", size,
                                                  [&](auto *next, size_t n) { return next(file, to, n); });
}
ssize_t write(int file, const void *from, size_t size) {
    return transfer<ssize_t(int, const void *, size_t)>("write", size,
                                                        [&](auto *next, size_t n) { return next(file, from, n); });
}
ssize_t pwrite(int file, const void *from, size_t size, off_t at) {
    return transfer<ssize_t(int, const void *, size_t, off_t)>(
        "pwrite", size, [&](auto *next, size_t n) { return next(file, from, n, at); });
}
ssize_t pwrite64(int file, const void *from, size_t size, off_t at) { return pwrite(file, from, size, at); }
int close(int file) {
    static auto *const next = real<int(int)>("close");
    const Fate fate = next_call("close");
    const int failure = errno, closed = next(file); // also a failed close frees the descriptor
    errno = fate == Fate::failed ? failure : errno;
    return fate == Fate::failed ? -1 : closed;
}
int fsync(int file) { return call<int(int)>("fsync", file); }
int flock(int file, int how) noexcept { return call<int(int, int)>("flock", file, how); }
int ftruncate(int file, off_t size) noexcept { return call<int(int, off_t)>("ftruncate", file, size); }
int ftruncate64(int file, off_t size) noexcept { return call<int(int, off_t)>("ftruncate", file, size); }
int fchmod(int file, mode_t mode) noexcept { return call<int(int, mode_t)>("fchmod", file, mode); }
int access(const char *path, int how) noexcept { return call<int(const char *, int)>("access", path, how); }
int dup(int file) noexcept { return call<int(int)>("dup", file); }
int fstat(int file, struct stat *status) noexcept { return call<int(int, struct stat *)>("fstat", file, status); }
int stat(const char *path, struct stat *status) noexcept {
    return call<int(const char *, struct stat *)>("stat", path, status);
}
int fstatat(int folder, const char *path, struct stat *status, int how) noexcept {
    return call<int(int, const char *, struct stat *, int)>("fstatat", folder, path, status, how);
}
ssize_t readlink(const char *path, char *to, size_t size) noexcept {
    return call<ssize_t(const char *, char *, size_t)>("readlink", path, to, size);
}
int rename(const char *from, const char *to) noexcept {
    return call<int(const char *, const char *)>("rename", from, to);
}
int renameat(int from_folder, const char *from, int to_folder, const char *to) noexcept {
    return call<int(int, const char *, int, const char *)>("renameat", from_folder, from, to_folder, to);
}
int unlink(const char *path) noexcept { return call<int(const char *)>("unlink", path); }
int unlinkat(int folder, const char *path, int how) noexcept {
    return call<int(int, const char *, int)>("unlinkat", folder, path, how);
}
int pipe2(int *ends, int flags) noexcept { return call<int(int *, int)>("pipe2", ends, flags); }
pid_t fork() noexcept { return call<pid_t()>("fork"); }
pid_t waitpid(pid_t child, int *state, int how) { return call<pid_t(pid_t, int *, int)>("waitpid", child, state, how); }
void *mmap(void *at, size_t size, int access, int how, int file, off_t offset) noexcept {
    static auto *const next = real<void *(void *, size_t, int, int, int, off_t)>("mmap");
    return next_call("mmap") == Fate::failed ? MAP_FAILED : next(at, size, access, how, file, offset);
}
void *mmap64(void *at, size_t size, int access, int how, int file, off_t offset) noexcept {
    return mmap(at, size, access, how, file, offset);
}
int madvise(void *at, size_t size, int advice) noexcept {
    return call<int(void *, size_t, int)>("madvise", at, size, advice);
}
int sync_file_range(int file, off64_t at, off64_t size, unsigned flags) {
    return call<int(int, off64_t, off64_t, unsigned)>("sync_file_range", file, at, size, flags);
}
int fallocate(int file, int mode, off_t at, off_t size) {
    return call<int(int, int, off_t, off_t)>("fallocate", file, mode, at, size);
}
int fallocate64(int file, int mode, off64_t at, off64_t size) { return fallocate(file, mode, at, size); }
int posix_fallocate(int file, off_t at, off_t size) { // returns the error
    static auto *const next = real<int(int, off_t, off_t)>("posix_fallocate");
    return next_call("posix_fallocate") == Fate::failed ? errno : next(file, at, size);
}
int posix_fallocate64(int file, off64_t at, off64_t size) { return posix_fallocate(file, at, size); }
void *mremap(void *at, size_t before, size_t size, int how, ...) noexcept {
    static auto *const next = real<void *(void *, size_t, size_t, int, ...)>("mremap");
    return next_call("mremap") == Fate::failed ? MAP_FAILED : next(at, before, size, how);
}

} // extern "C"
