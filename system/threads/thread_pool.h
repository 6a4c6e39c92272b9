// The one place that begins threads. A pool shares loops out between its workers and the calling thread (`run`), and
// does work that takes longer than a frame (`post`). Its workers stay: to begin a thread takes too long for each frame.
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
    // `threads` 1.. in all: the calling thread and the workers that begin here. If the system gives fewer, those do the
    // same work. If there is no worker, the calling thread does posted work at once.
    explicit ThreadPool(int threads);
    // Waits for the piece of work under way. Posted work that was not begun is dropped: its promise is broken.
    ~ThreadPool();
    ThreadPool(const ThreadPool &) = delete;
    ThreadPool &operator=(const ThreadPool &) = delete;

    int threads() const { return static_cast<int>(workers_.size()) + 1; }

    // Calls `work(i, thread)` for 0 <= i < count in some order, each i once, `thread` < threads(), and waits for all of
    // them. Rethrows the first exception of any item; other items may then be left out. One call at a time, not from
    // work of the same pool.
    void run(std::size_t count, const std::function<void(std::size_t, std::size_t)> &work);

    // Enqueues `work` for the next idle worker; one worker keeps the order. Its exceptions come out of the future.
    template <class Work> auto post(Work work) {
        auto task = std::make_shared<std::packaged_task<std::invoke_result_t<Work>()>>(std::move(work));
        auto result = task->get_future();
        add([task] { (*task)(); });
        return result;
    }
    // Whether posted work is queued or under way.
    bool busy() const;

    // `wake` is called after every piece of posted work, by its thread, and by `wake()`. Empty: nothing is called, and
    // no call is under way any more when this returns.
    void set_wake(std::function<void()> wake);
    void wake() const; // any thread

  private:
    struct Loop;
    void serve(std::size_t thread);
    void take_items(Loop &loop, std::size_t thread);
    void add(std::function<void()> work);

    mutable std::mutex mutex_; // of the next five
    Loop *loop_ = nullptr;     // that workers may join
    std::deque<std::function<void()>> queue_;
    std::size_t posted_ = 0; // queued or under way
    std::function<void()> wake_;
    bool stop_ = false;

    std::condition_variable more_, end_; // there is work, or stop_; the loop has lost its last worker
    std::vector<std::thread> workers_;
};

template <class T> bool is_ready(const std::future<T> &future) {
    return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

} // namespace pbm
