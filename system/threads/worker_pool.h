// Threads that stay from frame to frame, since a frame takes little longer than it takes to begin a thread.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace pbm {

class WorkerPool {
  public:
    // `threads` 1.. in all; the calling thread is one of them.
    explicit WorkerPool(int threads);
    ~WorkerPool();
    WorkerPool(const WorkerPool &) = delete;
    WorkerPool &operator=(const WorkerPool &) = delete;

    int threads() const { return static_cast<int>(workers_.size()) + 1; }

    // Calls `work(i, thread)` for 0 <= i < count in some order, each i once, `thread` 0 .. threads() - 1, and waits for
    // all of them. The first exception of any item is thrown again here; the others may then be left out. One call at a
    // time.
    void run(std::size_t count, const std::function<void(std::size_t, std::size_t)> &work);

  private:
    void serve(std::size_t thread);
    void take_items(std::size_t thread);

    std::mutex mutex_; // of the next five
    std::condition_variable begin_, end_;
    std::size_t round_ = 0, busy_ = 0;
    bool stop_ = false;
    const std::function<void(std::size_t, std::size_t)> *work_ = nullptr;

    std::size_t count_ = 0;
    std::atomic<std::size_t> next_{0};
    std::exception_ptr failure_;        // with mutex_ held
    std::vector<std::jthread> workers_; // last: they begin when all else is there
};

} // namespace pbm
