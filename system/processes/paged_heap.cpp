#include "system/processes/paged_heap.h"

#include "system/files/descriptor.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

namespace pbm {
namespace {

constexpr std::size_t kPage = 4096;
constexpr std::size_t kSmall = std::size_t{1} << 14;  // blocks below this size stay in memory
constexpr std::size_t kLarge = std::size_t{1} << 20;  // mappings of other files below this size are not looked at
constexpr std::size_t kSlab = std::size_t{16} << 20;  // of blocks of one size between these
constexpr std::size_t kStride = std::size_t{8} << 20; // that is given back at once
constexpr int kStridesAtOnce = 8;
constexpr std::uint64_t kFilled = std::uint64_t{256} << 20; // bytes that may be filled between two looks
constexpr std::chrono::milliseconds kLook{2}, kTrim{200};
// Percent of the limit without kFilled, or of its half. Blocks of up to kInMemory lie in memory, all others in the
// file. Above kBegin pages are given back until kEnd are resident.
constexpr std::uint64_t kInMemory = 40, kEnd = 45, kBegin = 60;

// For the heap's own lists, which must not allocate from it.
template <class T> struct SystemAllocator {
    using value_type = T;
    SystemAllocator() = default;
    template <class U> SystemAllocator(const SystemAllocator<U> &) {}
    T *allocate(std::size_t count) {
        void *const block = std::malloc(count * sizeof(T));
        return block == nullptr ? throw std::bad_alloc() : static_cast<T *>(block);
    }
    void deallocate(T *block, std::size_t) { std::free(block); }
    bool operator==(const SystemAllocator &) const = default;
};
template <class T> using SystemVector = std::vector<T, SystemAllocator<T>>;

// The resident memory of this process. Reading it allocates nothing.
class ResidentMemory {
  public:
    ResidentMemory() : file_(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC)) {}
    std::uint64_t bytes() const {
        std::array<char, 128> text{};
        unsigned long long size = 0, pages = 0;
        const bool is_read = ::pread(file_.number(), text.data(), text.size() - 1, 0) > 0 &&
                             std::sscanf(text.data(), "%llu %llu", &size, &pages) == 2;
        return is_read ? pages * kPage : 0;
    }

  private:
    Descriptor file_;
};

class PagedHeap {
  public:
    PagedHeap(std::string folder, int file, std::uint64_t limit)
        : folder_(std::move(folder)), file_(file), limit_(std::max(limit / 2, limit - std::min(limit, kFilled))) {
        std::thread([this] { keep_below_limit(); }).detach(); // until the process ends
    }

    // Null: the block is to lie in memory. Throws std::bad_alloc if the folder is full.
    void *allocate(std::size_t bytes) {
        if (in_memory_ + static_cast<std::int64_t>(bytes) <= static_cast<std::int64_t>(percent(kInMemory)))
            return nullptr;
        const std::size_t number = bytes > size_of(kClasses - 1) ? kOwnPages : class_of(bytes);
        {
            const std::lock_guard lock(mutex_);
            give_back(); // the thread that does so may get no processor for a while
            if (number != kOwnPages && !free_[number].empty())
                return take_free(number);
        }
        Region region{0, number == kOwnPages ? (bytes + kPage - 1) / kPage * kPage : kSlab, number};
        region.at = end_.fetch_add(region.size);
        char *const mapped = map_file(region); // takes a while on a busy disk: others go on
        const std::lock_guard lock(mutex_);
        regions_.emplace(mapped, region);
        if (number == kOwnPages)
            return mapped;
        const std::size_t size = size_of(number);
        for (std::size_t at = kSlab / size * size; at >= size; at -= size)
            free_[number].push_back(mapped + at - size); // the first block is the next one
        return take_free(number);
    }

    // Counts a block that was put into memory, or one that leaves it.
    void count_in_memory(std::int64_t bytes) { in_memory_ += bytes; }

    // Around fork: the child would share these blocks with its parent, so it allocates none of them.
    void before_fork() { mutex_.lock(); }
    void after_fork_in_parent() { mutex_.unlock(); }
    void after_fork_in_child() {
        is_child_ = true;
        mutex_.unlock();
    }
    bool is_child() const { return is_child_; }

    // Why the folder last had no room.
    Status room() const {
        const int error = room_error_;
        return error == 0 ? Status()
                          : Error{ErrorCode::memory, 0,
                                  folder_ + ": no room for temporary files: " + std::generic_category().message(error)};
    }

    // False: the block is none of this heap.
    bool release(void *block) {
        std::unique_lock lock(mutex_);
        const auto behind = regions_.upper_bound(static_cast<char *>(block));
        if (behind == regions_.begin())
            return false;
        const auto found = std::prev(behind);
        const Region region = found->second;
        if (static_cast<char *>(block) >= found->first + region.size)
            return false;
        if (is_child_) // it is the parent's
            return true;
        if (region.number != kOwnPages) {
            free_[region.number].push_back(static_cast<char *>(block));
            return true;
        }
        regions_.erase(found);
        lock.unlock(); // this takes a while for a large block
        ::munmap(block, region.size);
        ::fallocate(file_.number(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, static_cast<off_t>(region.at),
                    static_cast<off_t>(region.size));
        return true;
    }

  private:
    static constexpr std::size_t kClasses = 24, kOwnPages = kClasses;

    struct Region {
        std::uint64_t at; // in the file
        std::size_t size;
        std::size_t number; // of its blocks' class
    };

    // Four sizes in each octave, all of them whole pages: 16, 20, 24, 28, 32, 40 KiB ...
    static std::size_t size_of(std::size_t number) { return (kSmall / 4 << number / 4) * (4 + number % 4); }
    static std::size_t class_of(std::size_t bytes) {
        std::size_t number = 0;
        while (size_of(number) < bytes)
            ++number;
        return number;
    }

    // At least one block is free. The mutex is held.
    char *take_free(std::size_t number) {
        char *const block = free_[number].back();
        free_[number].pop_back();
        return block;
    }

    char *map_file(const Region &region) {
        // Reserved now: a full disk is an error here, and no signal when a page is touched.
        const auto at = static_cast<off_t>(region.at), size = static_cast<off_t>(region.size);
        int error = 0;
        do
            error = ::posix_fallocate(file_.number(), at, size);
        while (error == EINTR);
        void *const block = error != 0
                                ? MAP_FAILED
                                : ::mmap(nullptr, region.size, PROT_READ | PROT_WRITE, MAP_SHARED, file_.number(), at);
        if (block == MAP_FAILED) {
            room_error_ = error != 0 ? error : errno;
            throw std::bad_alloc();
        }
        return static_cast<char *>(block);
    }

    std::uint64_t percent(std::uint64_t of_limit) const { return limit_ / 100 * of_limit; }

    [[noreturn]] void keep_below_limit() {
        using Clock = std::chrono::steady_clock;
        for (Clock::time_point next_trim{};;) {
            std::this_thread::sleep_for(kLook);
            end_if_pages_are_lost();
            if (resident_.bytes() <= percent(kBegin))
                continue;
            if (Clock::now() >= next_trim) { // what was freed is kept for later blocks
                ::malloc_trim(0);
                next_trim = Clock::now() + kTrim;
            }
            {
                const std::lock_guard lock(mutex_);
                give_back();
            }
            drop_files_that_are_read();
        }
    }

    // The system reports once that it could not write pages of the file, and may drop them then. The question is about
    // a range without pages, so that it waits for none.
    void end_if_pages_are_lost() const {
        constexpr off64_t kBehindAll = off64_t{1} << 62;
        if (::sync_file_range(file_.number(), kBehindAll, 1, SYNC_FILE_RANGE_WAIT_BEFORE) == 0)
            return;
        const int error = errno;
        if (error != EIO && error != ENOSPC && error != EDQUOT)
            return;
        const std::string line = std::string(::program_invocation_short_name) + ": " + folder_ +
                                 ": cannot write temporary files: " + std::generic_category().message(error) + "\n";
        write_all(STDERR_FILENO, as_bytes(line));
        ::_exit(exit_code(ErrorCode::io));
    }

    // Takes pages of the file out of this process if too many are resident. They stay in the cache of the system, which
    // writes and drops them as memory is needed. One call goes once around all regions at most, from where the last
    // call ended. The mutex is held.
    void give_back() {
        if (resident_.bytes() <= percent(kBegin))
            return;
        for (std::size_t turns = 0; turns <= regions_.size(); ++turns) {
            auto found = regions_.upper_bound(hand_);
            if (found != regions_.begin() && hand_ < std::prev(found)->first + std::prev(found)->second.size)
                --found;
            if (found == regions_.end()) {
                hand_ = nullptr;
                continue;
            }
            char *const end = found->first + found->second.size;
            for (hand_ = std::max(hand_, found->first); hand_ < end;) {
                const std::size_t size = std::min(kStride, static_cast<std::size_t>(end - hand_));
                ::madvise(hand_, size, MADV_DONTNEED); // of a shared mapping: its contents stay
                hand_ += size;
                if (resident_.bytes() <= percent(kEnd))
                    return;
            }
        }
    }

    // Drops some pages of large mappings of other files, such as a scan, which is read from its start to its end, if
    // too many are resident: a few strides, since that takes milliseconds. A mapping that is unmapped meanwhile does no
    // harm: whatever takes its place is paged out and read again.
    void drop_files_that_are_read() {
        if (resident_.bytes() <= percent(kBegin))
            return;
        int left = kStridesAtOnce;
        std::FILE *const file = std::fopen("/proc/self/maps", "r");
        std::array<char, 512> line{};
        while (file != nullptr && std::fgets(line.data(), line.size(), file) != nullptr) {
            void *first = nullptr, *last = nullptr;
            unsigned long inode = 0;
            std::array<char, 5> access{};
            if (std::sscanf(line.data(), "%p-%p %4s %*s %*s %lu", &first, &last, access.data(), &inode) != 4)
                continue;
            auto *const begin = static_cast<char *>(first), *const end = static_cast<char *>(last);
            const auto size = static_cast<std::size_t>(end - begin);
            if (inode == 0 || size < kLarge || access[1] != '-' || access[2] != '-')
                continue;
            const std::size_t start =
                begin <= hand_in_files_ && hand_in_files_ < end ? static_cast<std::size_t>(hand_in_files_ - begin) : 0;
            for (std::size_t done = 0; done < size && left > 0; done += kStride, --left) {
                char *const at = begin + (start + done) % size;
                ::madvise(at, std::min(kStride, static_cast<std::size_t>(end - at)), MADV_PAGEOUT);
                hand_in_files_ = begin + (start + done + kStride) % size;
            }
        }
        if (file != nullptr)
            std::fclose(file);
    }

    std::string folder_;
    Descriptor file_;
    std::uint64_t limit_; // without what may be filled between two looks
    ResidentMemory resident_;
    char *hand_in_files_ = nullptr;          // pages of other files were dropped up to here
    std::atomic<int> room_error_{0};         // errno
    std::atomic<std::int64_t> in_memory_{0}; // bytes of blocks of kSmall and more that do not lie in the file
    std::atomic<std::uint64_t> end_{0};      // of the file
    std::mutex mutex_;                       // guards the next three
    std::map<char *, Region, std::less<>, SystemAllocator<std::pair<char *const, Region>>> regions_;
    std::array<SystemVector<char *>, kClasses> free_;
    char *hand_ = nullptr;  // pages were given back up to here
    bool is_child_ = false; // set before the child has a second thread
};

std::atomic<PagedHeap *> the_heap{nullptr};

} // namespace

Status page_heap(const std::string &folder, std::uint64_t limit) {
    const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file < 0)
        return io_error("cannot make a temporary file", errno);
    the_heap.store(new PagedHeap(folder, file, limit)); // never deleted: blocks outlive main
    ::pthread_atfork([] { the_heap.load()->before_fork(); }, [] { the_heap.load()->after_fork_in_parent(); },
                     [] { the_heap.load()->after_fork_in_child(); });
    return {};
}

Status paged_heap_room() {
    const PagedHeap *const heap = the_heap.load();
    return heap == nullptr ? Status() : heap->room();
}

} // namespace pbm

#ifndef PBM_SANITIZE // a sanitizer has a heap of its own
namespace pbm {

// Null before page_heap was called.
static PagedHeap *heap_in_use() { return the_heap.load(std::memory_order_acquire); }

static void *allocate_in_memory(std::size_t bytes, std::size_t alignment) {
    for (;;) {
        if (void *const block = alignment <= alignof(std::max_align_t)
                                    ? std::malloc(std::max<std::size_t>(bytes, 1))
                                    : std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment))
            return block;
        if (const std::new_handler handler = std::get_new_handler())
            handler();
        else
            throw std::bad_alloc();
    }
}

static void *allocate(std::size_t bytes, std::size_t alignment = alignof(std::max_align_t)) {
    constexpr std::size_t kRounding = 64; // of the system's heap
    PagedHeap *const heap = bytes + kRounding >= kSmall ? heap_in_use() : nullptr;
    if (heap != nullptr && bytes >= kSmall && alignment <= kPage && !heap->is_child())
        if (void *const block = heap->allocate(bytes))
            return block;
    void *const block = allocate_in_memory(bytes, alignment);
    if (const std::size_t size = heap != nullptr ? ::malloc_usable_size(block) : 0; size >= kSmall)
        heap->count_in_memory(static_cast<std::int64_t>(size));
    return block;
}

static void release(void *block) {
    if (PagedHeap *const heap = heap_in_use()) {
        if (reinterpret_cast<std::uintptr_t>(block) % kPage == 0 && heap->release(block))
            return;
        if (const std::size_t size = ::malloc_usable_size(block); size >= kSmall)
            heap->count_in_memory(-static_cast<std::int64_t>(size));
    }
    std::free(block);
}

} // namespace pbm

// The heap of this program. Whatever is allocated before page_heap is called stays where it is.
void *operator new(std::size_t bytes) { return pbm::allocate(bytes); }
void *operator new(std::size_t bytes, std::align_val_t alignment) {
    return pbm::allocate(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void *block) noexcept {
    if (block != nullptr)
        pbm::release(block);
}
void operator delete(void *block, std::size_t) noexcept { operator delete(block); }
void operator delete(void *block, std::align_val_t) noexcept { operator delete(block); }
void operator delete(void *block, std::size_t, std::align_val_t) noexcept { operator delete(block); }
#endif
