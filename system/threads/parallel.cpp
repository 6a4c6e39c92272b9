#include "system/threads/parallel.h"

#include "system/threads/thread_pool.h"

#include <algorithm>
#include <thread>

namespace pbm {

int resolve_threads(int threads) {
    return std::min(kMaxThreads,
                    threads > 0 ? threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)> &work) {
    const auto useful = static_cast<int>(std::clamp<std::size_t>(count, 1, kMaxThreads));
    ThreadPool(std::min(useful, resolve_threads(threads))).run(count, [&](std::size_t i, std::size_t) { work(i); });
}

void parallel_blocks(std::size_t count, std::size_t block, int threads,
                     const std::function<void(std::size_t, std::size_t)> &work) {
    parallel_for((count + block - 1) / block, threads,
                 [&](std::size_t i) { work(i * block, std::min((i + 1) * block, count)); });
}

} // namespace pbm
