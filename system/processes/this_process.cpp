#include "system/processes/this_process.h"

#include "system/error.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

namespace pbm {

void make_write_errors_returns() {
    // Open /dev/null in the wrong mode for each closed stream: its use fails, and no later file gets its number.
    for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(number, F_GETFD) < 0)
            static_cast<void>(::open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY));
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

namespace {

// The signal handler's message; the handler may use async-signal-safe calls only.
std::array<char, 160> shrink_message{};

std::atomic_flag has_shrunk;

extern "C" void report_shrunk_file(int) {
    if (has_shrunk.test_and_set()) // another thread is ending the program
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

namespace {

constexpr std::uintptr_t kLargePage = 2 << 20;

} // namespace

std::span<std::byte> use_large_pages() {
#ifdef __GLIBC__
    constexpr int kMaxAtOnce = 32 << 20; // the largest threshold allowed
    constexpr int kHeap = 256 << 20;     // address space, not memory
    ::mallopt(M_ARENA_MAX, 1);
    ::mallopt(M_MMAP_THRESHOLD, kMaxAtOnce);
    ::mallopt(M_TRIM_THRESHOLD, kHeap);
    ::mallopt(M_TOP_PAD, kHeap);
    // A block that does not fit makes the heap grow.
    std::unique_ptr<void, decltype(&std::free)> block(std::malloc(kMaxAtOnce / 2), std::free);
    const auto address = reinterpret_cast<std::uintptr_t>(block.get());
    const std::uintptr_t end = reinterpret_cast<std::uintptr_t>(::sbrk(0)), gap = kLargePage - address % kLargePage;
    // If the heap cannot grow, the block lies elsewhere.
    if (block == nullptr || address >= end || end - address > 2 * std::uintptr_t{kHeap})
        return {};
    const std::span<std::byte> pages(static_cast<std::byte *>(block.get()) + gap, kMaxAtOnce / 2 - gap);
    static_cast<void>(::madvise(pages.data(), end - address - gap, MADV_HUGEPAGE));
    block.reset();
    // Leave unused what lies before the first large page. Volatile, since compilers remove allocations without effect.
    [[maybe_unused]] static void *volatile const unused = std::malloc(gap);
    return pages;
#else
    return {};
#endif
}

void populate([[maybe_unused]] std::span<std::byte> pages) {
#ifdef MADV_POPULATE_WRITE
    for (; pages.size() >= kLargePage; pages = pages.subspan(kLargePage)) // one by one, so that others may map memory
        static_cast<void>(::madvise(pages.data(), kLargePage, MADV_POPULATE_WRITE));
#endif
}

void lower_priority() {
    constexpr int kLowest = 19;
    // On Linux, 0 is the calling thread.
    static_cast<void>(::setpriority(PRIO_PROCESS, 0, kLowest));
}

std::uint64_t peak_memory() {
    struct rusage usage {};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

} // namespace pbm
