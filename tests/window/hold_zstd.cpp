// Preloaded by window_test.py: decompression to at least $PBM_TEST_HOLD_FROM bytes (default 0) blocks while the file
// $PBM_TEST_HOLD exists, so that a test can observe a program while it loads. With $PBM_TEST_BLIND no file is watched.
#include <dlfcn.h>
#include <unistd.h>

#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <thread>

extern "C" int inotify_init1(int flags) {
    using Begin = int(int);
    auto *const begin = reinterpret_cast<Begin *>(dlsym(RTLD_NEXT, "inotify_init1"));
    return std::getenv("PBM_TEST_BLIND") == nullptr ? begin(flags) : -1;
}

extern "C" std::size_t ZSTD_decompressDCtx(void *context, void *target, std::size_t capacity, const void *source,
                                           std::size_t size) {
    using Decompress = std::size_t(void *, void *, std::size_t, const void *, std::size_t);
    auto *const decompress = reinterpret_cast<Decompress *>(dlsym(RTLD_NEXT, "ZSTD_decompressDCtx"));
    const char *const hold = std::getenv("PBM_TEST_HOLD");
    const char *const from = std::getenv("PBM_TEST_HOLD_FROM");
    const bool is_held = hold != nullptr && capacity >= (from == nullptr ? 0 : std::strtoull(from, nullptr, 10));
    while (is_held && access(hold, F_OK) == 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return decompress(context, target, capacity, source, size);
}
