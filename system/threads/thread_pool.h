// The only code that starts threads. A pool distributes loops over its workers and the calling thread (`run`), and runs
// long tasks (`post`). Workers live as long as the pool, since starting threads takes too long for every frame.
// Stability: experimental.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace pbm {

class ThreadPool {
  public:
    // `threads`: total number, 1 or more: the calling thread and the workers that start here. If the system gives
    // fewer, those do all work. Without workers, the calling thread runs posted tasks at once.
    explicit ThreadPool(int threads);
    // Waits for running tasks. Drops tasks that have not started: their promises are broken.
    ~ThreadPool();
    ThreadPool(const ThreadPool &) = delete;
    ThreadPool &operator=(const ThreadPool &) = delete;

    int threads() const { return static_cast<int>(workers_.size()) + 1; }

    // Calls `work(i, thread)` once for each 0 <= i < count, in any order, with `thread` < threads(), and waits for all
    // calls. Rethrows the first exception of any item; other items may then be skipped. Only one call at a time, and
    // not from work of the same pool.
    void run(std::size_t count, const std::function<void(std::size_t, std::size_t)> &work);

    // Enqueues `work` for the next idle worker; a single worker keeps the order. The future passes on exceptions.
    template <class Work> auto post(Work work) {
        auto task = std::make_shared<std::packaged_task<std::invoke_result_t<Work>()>>(std::move(work));
        auto result = task->get_future();
        add([task] { (*task)(); });
        return result;
    }
    // Whether posted tasks are queued or running.
    bool busy() const;

    // `wake` is called after every posted task, by its thread, and by `wake()`. An empty function disables it: no call
    // is running when this returns.
    void set_wake(std::function<void()> wake);
    void wake() const; // callable from any thread

  private:
    struct Loop;
    void serve(std::size_t thread);
    void take_items(Loop &loop, std::size_t thread);
    void add(std::function<void()> work);

    mutable std::mutex mutex_; // guards the next five
    Loop *loop_ = nullptr;     // open to workers
    std::deque<std::function<void()>> queue_;
    std::size_t posted_ = 0; // queued or running
    std::function<void()> wake_;
    bool stop_ = false;

    std::condition_variable more_, end_; // work or stop_; the loop's last worker has left
    std::vector<std::thread> workers_;
};

template <class T> bool is_ready(const std::future<T> &future) {
    return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

} // namespace pbm
