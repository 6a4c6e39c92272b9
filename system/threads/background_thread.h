// One thread for work that takes longer than a frame; results are futures.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

namespace pbm {

class BackgroundThread {
  public:
    BackgroundThread();
    // Waits for the piece of work under way; those not begun are dropped and leave broken promises.
    ~BackgroundThread();
    BackgroundThread(const BackgroundThread &) = delete;
    BackgroundThread &operator=(const BackgroundThread &) = delete;

    // Called after every piece of work, on this thread, and by `wake`, from now on. Empty: nothing is called, and
    // nothing is being called any more when this returns.
    void set_wake(std::function<void()> wake);
    // Calls it now. Any thread.
    void wake() const;

    // Queues `work`. Its exceptions come out of the future.
    template <class Work> auto post(Work work) {
        auto task = std::make_shared<std::packaged_task<std::invoke_result_t<Work>()>>(std::move(work));
        auto result = task->get_future();
        add([task] { (*task)(); });
        return result;
    }

    // Whether something is queued or under way.
    bool busy() const;

  private:
    void add(std::function<void()> work);
    void run(const std::stop_token &stop);

    mutable std::mutex mutex_; // of the three below
    std::deque<std::function<void()>> queue_;
    bool working_ = false;
    std::function<void()> wake_;

    std::condition_variable_any more_;
    std::jthread thread_; // last: begins when all else is there
};

template <class T> bool is_ready(const std::future<T> &future) {
    return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

} // namespace pbm
