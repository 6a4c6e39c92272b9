// Runs a loop on several threads. Every index writes only its own slots, so the result cannot depend on the thread
// count.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace pbm::sample {

// Calls body(begin, end) for consecutive ranges of at most `grain` indices that cover [0, count). `threads` >= 1.
// The first exception of a body is thrown here, after all threads have stopped.
template <typename Body> void parallel_for(std::size_t count, std::size_t grain, unsigned threads, const Body &body) {
    std::atomic<std::size_t> next = 0;
    std::exception_ptr failure;
    std::mutex failure_mutex;
    const auto work = [&] {
        for (std::size_t begin = next.fetch_add(grain); begin < count; begin = next.fetch_add(grain)) {
            try {
                body(begin, std::min(begin + grain, count));
            } catch (...) {
                const std::lock_guard lock(failure_mutex);
                if (!failure)
                    failure = std::current_exception();
                next = count;
            }
        }
    };
    {
        std::vector<std::jthread> helpers;
        const std::size_t ranges = (count + grain - 1) / grain;
        for (std::size_t i = 1; i < std::min<std::size_t>(threads, ranges); ++i)
            helpers.emplace_back(work);
        work();
    }
    if (failure)
        std::rethrow_exception(failure);
}

} // namespace pbm::sample
