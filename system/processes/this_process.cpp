#include "system/processes/this_process.h"

#include "system/error.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>
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

// The signal handler may use async-signal-safe calls only, and memory that is there already.
std::array<char, 41> program_name{};
std::array<char, 4200> map_line{}; // a path has at most 4,096 bytes

std::atomic_flag has_shrunk;

// The hexadecimal number at the front of `text`, which is removed.
std::uintptr_t take_address(std::string_view &text) {
    std::uintptr_t address = 0;
    const std::size_t digits = std::min(text.find_first_not_of("0123456789abcdef"), text.size());
    for (const char digit : text.substr(0, digits))
        address = address * 16 + static_cast<std::uintptr_t>(digit <= '9' ? digit - '0' : digit - 'a' + 10);
    text.remove_prefix(digits);
    return address;
}

// The name of the file that is mapped at `address`, from a line of /proc/self/maps; empty if it is mapped elsewhere.
std::string_view mapped_name(std::string_view line, std::uintptr_t address) {
    const std::uintptr_t begin = take_address(line);
    line.remove_prefix(std::min<std::size_t>(1, line.size())); // a dash
    const std::uintptr_t end = take_address(line);
    const std::size_t name = line.find('/');
    return address < begin || address >= end || name == std::string_view::npos ? std::string_view() : line.substr(name);
}

std::string_view mapped_name(std::uintptr_t address) {
    const int maps = ::open("/proc/self/maps", O_RDONLY | O_CLOEXEC);
    std::size_t size = 0;
    for (char c = 0; ::read(maps, &c, 1) == 1;) {
        if (c != '\n' && size < map_line.size()) {
            map_line[size++] = c;
        } else if (c == '\n') {
            if (const auto name = mapped_name({map_line.data(), size}, address); !name.empty())
                return name;
            size = 0;
        }
    }
    return {};
}

std::atomic<bool> reads_zeros = false;

// Puts a page of zeros in the place of one that its file has lost.
bool replace_lost_page(const siginfo_t &info) {
    if (info.si_code != BUS_ADRERR)
        return false;
    const auto size = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    auto *const address = static_cast<char *>(info.si_addr);
    return ::mmap(address - reinterpret_cast<std::uintptr_t>(address) % size, size, PROT_READ,
                  MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) != MAP_FAILED;
}

extern "C" void report_shrunk_file(int, siginfo_t *info, void *) {
    if (reads_zeros && replace_lost_page(*info))
        return;
    if (has_shrunk.test_and_set()) // another thread is ending the program
        for (;;)
            ::pause();
    const auto say = [](std::string_view text) { return ::write(STDERR_FILENO, text.data(), text.size()) >= 0; };
    bool said = say(program_name.data()) && say(": ");
    if (const std::string_view name = mapped_name(reinterpret_cast<std::uintptr_t>(info->si_addr)); !name.empty()) {
        for (char &c : std::span(map_line)) // the kernel writes line feeds as \012, but no other control characters
            c = static_cast<unsigned char>(c) < ' ' || c == '\x7f' ? '?' : c;
        said = said && say(name) && say(": ");
    }
    said = said && say("the file became shorter while it was read; wait until it is written and try again\n");
    ::_exit(said ? exit_code(ErrorCode::io) : 2);
}

} // namespace

void end_when_mapped_file_shrinks(std::string_view program) {
    program.copy(program_name.data(), program_name.size() - 1);
    struct sigaction action {};
    action.sa_sigaction = report_shrunk_file;
    action.sa_flags = SA_SIGINFO;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(SIGBUS, &action, nullptr);
}

void read_zeros_when_mapped_file_shrinks() { reads_zeros = true; }

std::optional<std::uint64_t> address_space_limit() {
    struct rlimit limit {};
    if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
        return std::nullopt;
    return limit.rlim_cur;
}

namespace {

constexpr std::uintptr_t kLargePage = 2 << 20;

} // namespace

std::span<std::byte> use_large_pages() {
#ifdef __GLIBC__
    constexpr int kMaxAtOnce = 32 << 20;        // the largest threshold allowed
    constexpr int kHeap = 256 << 20;            // address space, not memory
    constexpr std::size_t kFirst = 1 << 20;     // more than the heap has left
    constexpr std::size_t kReturned = 14 << 20; // of the large pages
    if (address_space_limit())                  // each block that the heap lacks would ask for that much
        return {};
    ::mallopt(M_ARENA_MAX, 1);
    ::mallopt(M_MMAP_THRESHOLD, kMaxAtOnce);
    ::mallopt(M_TRIM_THRESHOLD, kHeap);
    ::mallopt(M_TOP_PAD, kHeap);
    // A block that does not fit makes the heap grow.
    std::unique_ptr<void, decltype(&std::free)> block(std::malloc(kFirst), std::free);
    const auto address = reinterpret_cast<std::uintptr_t>(block.get());
    const auto end = reinterpret_cast<std::uintptr_t>(::sbrk(0));
    // The heap has written behind the block: a page of 2 MB takes no place where a small one lies already.
    const std::uintptr_t gap = kFirst + kLargePage - (address + kFirst) % kLargePage;
    // If the heap cannot grow, the block lies elsewhere, or at the end of what it had.
    if (block == nullptr || address >= end || end - address > 2 * std::uintptr_t{kHeap} ||
        end - address < gap + kReturned)
        return {};
    const std::span<std::byte> pages(static_cast<std::byte *>(block.get()) + gap, kReturned);
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
