// Preloaded by caches.py: the times of files have whole seconds, as on some network file systems.
#include <dlfcn.h>
#include <sys/stat.h>

namespace {

int with_whole_seconds(int result, struct stat *found) {
    if (result == 0)
        found->st_mtim.tv_nsec = found->st_ctim.tv_nsec = 0;
    return result;
}

} // namespace

extern "C" int stat(const char *path, struct stat *found) noexcept {
    using Stat = int(const char *, struct stat *);
    static auto *const next = reinterpret_cast<Stat *>(dlsym(RTLD_NEXT, "stat"));
    return with_whole_seconds(next(path, found), found);
}

extern "C" int fstat(int file, struct stat *found) noexcept {
    using Stat = int(int, struct stat *);
    static auto *const next = reinterpret_cast<Stat *>(dlsym(RTLD_NEXT, "fstat"));
    return with_whole_seconds(next(file, found), found);
}
