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
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

namespace pbm {
namespace {

constexpr std::size_t kPage = 4096;
constexpr std::size_t kSmall = std::size_t{1} << 14;  // blocks below this size stay in memory
constexpr std::size_t kLarge = std::size_t{1} << 20;  // mappings below this size are not looked at
constexpr std::size_t kSlab = std::size_t{16} << 20;  // file of blocks of one size between these
constexpr std::size_t kStride = std::size_t{8} << 20; // of a mapping that is written out at once
constexpr std::chrono::milliseconds kLook{2};

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

class PagedHeap {
  public:
    PagedHeap(std::string folder, std::uint64_t limit) : folder_(std::move(folder)), limit_(limit) {
        std::thread([this] { keep_below_limit(); }).detach(); // until the process ends
    }

    // Throws std::bad_alloc if the folder is full.
    void *allocate(std::size_t bytes) {
        if (bytes > size_of(kClasses - 1)) {
            const std::size_t size = (bytes + kPage - 1) / kPage * kPage;
            void *const block = map_file(size);
            const std::lock_guard lock(mutex_);
            regions_.emplace(block, Region{size, kOwnFile});
            return block;
        }
        const std::size_t number = class_of(bytes);
        const std::lock_guard lock(mutex_);
        SystemVector<char *> &free = free_[number];
        if (free.empty()) {
            auto *const slab = static_cast<char *>(map_file(kSlab));
            regions_.emplace(slab, Region{kSlab, number});
            const std::size_t size = size_of(number);
            for (std::size_t at = kSlab / size * size; at >= size; at -= size)
                free.push_back(slab + at - size); // the first block is the next one
        }
        char *const block = free.back();
        free.pop_back();
        return block;
    }

    // Around fork: the child would share these blocks with its parent, so it allocates none of them.
    void before_fork() { mutex_.lock(); }
    void after_fork_in_parent() { mutex_.unlock(); }
    void after_fork_in_child() {
        is_child_ = true;
        mutex_.unlock();
    }
    bool is_child() const { return is_child_; }

    // False: the block is none of this heap.
    bool release(void *block) {
        std::unique_lock lock(mutex_);
        const auto behind = regions_.upper_bound(block);
        if (behind == regions_.begin())
            return false;
        const auto found = std::prev(behind);
        const auto [size, number] = found->second;
        if (static_cast<char *>(block) >= static_cast<char *>(found->first) + size)
            return false;
        if (number != kOwnFile) {
            free_[number].push_back(static_cast<char *>(block));
            return true;
        }
        regions_.erase(found);
        lock.unlock(); // unmapping a large block takes a while
        ::munmap(block, size);
        return true;
    }

  private:
    static constexpr std::size_t kClasses = 24, kOwnFile = kClasses;
    struct Region {
        std::size_t size, number; // of its blocks' class
    };

    // Four sizes in each octave, all of them whole pages: 16, 20, 24, 28, 32, 40 KiB ...
    static std::size_t size_of(std::size_t number) { return (kSmall / 4 << number / 4) * (4 + number % 4); }
    static std::size_t class_of(std::size_t bytes) {
        std::size_t number = 0;
        while (size_of(number) < bytes)
            ++number;
        return number;
    }

    void *map_file(std::size_t size) const {
        const Descriptor file(::open(folder_.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
        // Reserved now: a full disk is an error here, and no signal when a page is touched.
        const int error = !file.ok() ? errno : ::posix_fallocate(file.number(), 0, static_cast<off_t>(size));
        void *const block =
            error != 0 ? MAP_FAILED : ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file.number(), 0);
        if (block != MAP_FAILED)
            return block;
        std::fprintf(stderr, "%s: no room for temporary files: %s\n", folder_.c_str(),
                     std::generic_category().message(error != 0 ? error : errno).c_str());
        throw std::bad_alloc();
    }

    static std::uint64_t resident() {
        std::FILE *const file = std::fopen("/proc/self/statm", "r");
        unsigned long long size = 0, pages = 0;
        const bool is_read = file != nullptr && std::fscanf(file, "%llu %llu", &size, &pages) == 2;
        if (file != nullptr)
            std::fclose(file);
        return is_read ? pages * kPage : 0;
    }

    [[noreturn]] void keep_below_limit() {
        const std::uint64_t high = limit_ / 100 * 85, low = limit_ / 100 * 75;
        for (;;) {
            std::this_thread::sleep_for(kLook);
            if (resident() > high)
                write_out_until(low);
        }
    }

    struct Mapping {
        char *begin;
        std::size_t size;
    };

    // Large mappings of files: our blocks, and what is mapped to be read, such as a scan.
    static SystemVector<Mapping> mappings() {
        SystemVector<Mapping> found;
        std::FILE *const file = std::fopen("/proc/self/maps", "r");
        std::array<char, 512> line{};
        while (file != nullptr && std::fgets(line.data(), line.size(), file) != nullptr) {
            void *first = nullptr, *last = nullptr;
            unsigned long inode = 0;
            std::array<char, 5> access{};
            if (std::sscanf(line.data(), "%p-%p %4s %*s %*s %lu", &first, &last, access.data(), &inode) != 4)
                continue;
            auto *const begin = static_cast<char *>(first);
            const auto size = static_cast<std::size_t>(static_cast<char *>(last) - begin);
            const bool is_block = access[1] == 'w' && access[3] == 's', is_read = access[1] == '-' && access[2] == '-';
            if (inode != 0 && size >= kLarge && (is_block || is_read))
                found.push_back({begin, size});
        }
        if (file != nullptr)
            std::fclose(file);
        return found;
    }

    // Once around all mappings at most, from where the last call ended. One that is unmapped meanwhile does no
    // harm: nothing is lost by writing pages out.
    void write_out_until(std::uint64_t low) {
        const SystemVector<Mapping> all = mappings();
        const auto first = static_cast<std::size_t>(
            std::find_if(all.begin(), all.end(), [&](const Mapping &m) { return hand_ < m.begin + m.size; }) -
            all.begin());
        for (std::size_t i = 0; i < all.size(); ++i) {
            const Mapping &mapping = all[(first + i) % all.size()];
            const bool is_begun = i == 0 && hand_ > mapping.begin && first < all.size();
            for (char *at = is_begun ? hand_ : mapping.begin; at < mapping.begin + mapping.size; at += kStride) {
                const std::size_t size = std::min(kStride, static_cast<std::size_t>(mapping.begin + mapping.size - at));
                ::madvise(at, size, MADV_PAGEOUT);
                hand_ = at + size;
                if (resident() <= low)
                    return;
            }
        }
    }

    std::string folder_;
    std::uint64_t limit_;
    std::mutex mutex_;
    std::map<void *, Region, std::less<>, SystemAllocator<std::pair<void *const, Region>>> regions_;
    std::array<SystemVector<char *>, kClasses> free_;
    char *hand_ = nullptr;
    bool is_child_ = false; // set before the child has a second thread
};

std::atomic<PagedHeap *> the_heap{nullptr};

} // namespace

Status page_heap(const std::string &folder, std::uint64_t limit) {
    const Descriptor file(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
    if (!file.ok())
        return io_error("cannot make a temporary file", errno);
    the_heap.store(new PagedHeap(folder, limit)); // never deleted: blocks outlive main
    ::pthread_atfork([] { the_heap.load()->before_fork(); }, [] { the_heap.load()->after_fork_in_parent(); },
                     [] { the_heap.load()->after_fork_in_child(); });
    return {};
}

} // namespace pbm

#ifndef PBM_SANITIZE // a sanitizer has a heap of its own
namespace pbm {

static void *allocate_paged(std::size_t bytes) {
    PagedHeap *const heap = bytes >= kSmall ? the_heap.load(std::memory_order_acquire) : nullptr;
    return heap == nullptr || heap->is_child() ? nullptr : heap->allocate(bytes);
}

static bool release_paged(void *block) {
    PagedHeap *const heap =
        reinterpret_cast<std::uintptr_t>(block) % kPage == 0 ? the_heap.load(std::memory_order_acquire) : nullptr;
    return heap != nullptr && heap->release(block);
}

} // namespace pbm

// The heap of this program. Whatever is allocated before page_heap is called stays where it is.
void *operator new(std::size_t bytes) {
    if (void *const block = pbm::allocate_paged(bytes))
        return block;
    for (;;) {
        if (void *const block = std::malloc(std::max<std::size_t>(bytes, 1)))
            return block;
        if (const std::new_handler handler = std::get_new_handler())
            handler();
        else
            throw std::bad_alloc();
    }
}
void operator delete(void *block) noexcept {
    if (block != nullptr && !pbm::release_paged(block))
        std::free(block);
}
void operator delete(void *block, std::size_t) noexcept { operator delete(block); }
#endif
