// Fixed work on a few threads: item i is done once, by whichever thread comes first, and writes only its own slot,
// so results never depend on the number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace pbm {

inline constexpr int kMaxThreads = 64;

// At most kMaxThreads; 0 asks for one thread per processor.
inline int resolve_threads(int threads) {
    return std::min(kMaxThreads,
                    threads > 0 ? threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

// Calls `work(i)` for 0 <= i < count. The first exception of any item is thrown again here, after all threads ended.
template <class Work> void parallel_for(std::size_t count, int threads, Work &&work) {
    const std::size_t workers = std::min(count, static_cast<std::size_t>(resolve_threads(threads)));
    if (workers <= 1) {
        for (std::size_t i = 0; i < count; ++i)
            work(i);
        return;
    }
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    std::mutex failure_mutex;
    const auto run = [&] {
        try {
            for (std::size_t i = next++; i < count; i = next++)
                work(i);
        } catch (...) {
            const std::lock_guard lock(failure_mutex);
            if (!failure)
                failure = std::current_exception();
            next = count;
        }
    };
    {
        std::vector<std::jthread> pool;
        pool.reserve(workers - 1);
        for (std::size_t i = 1; i < workers; ++i)
            try {
                pool.emplace_back(run);
            } catch (const std::system_error &) { // no more threads to be had: fewer do the same work
                break;
            }
        run();
    }
    if (failure)
        std::rethrow_exception(failure);
}

} // namespace pbm
