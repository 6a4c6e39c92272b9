// Parallel loops. Each item is processed once and writes its own slot only, so results do not depend on the threads.
#pragma once

#include <cstddef>
#include <functional>

namespace pbm {

inline constexpr int kMaxThreads = 64;

// Returns 1..kMaxThreads; 0 asks for one thread per processor.
int resolve_threads(int threads);

// Calls `work(i)` for 0 <= i < count on a temporary ThreadPool, and rethrows the first exception of any item.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)> &work);

// Distributes blocks of `block` items: calls `work(begin, end)` for each block.
void parallel_blocks(std::size_t count, std::size_t block, int threads,
                     const std::function<void(std::size_t, std::size_t)> &work);

// Distributes blocks of `block` items, and calls `work(i)` for each item.
template <class Work> void parallel_for(std::size_t count, std::size_t block, int threads, const Work &work) {
    parallel_blocks(count, block, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            work(i);
    });
}

} // namespace pbm
