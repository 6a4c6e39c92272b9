#include "system/threads/thread_pool.h"

#include "system/threads/cancellation.h"

#include <atomic>
#include <cassert>
#include <exception>

namespace pbm {

#if defined(__EMSCRIPTEN__) && !defined(__EMSCRIPTEN_PTHREADS__)
constexpr bool kHasThreads = false; // leaves out code that pages would download
#else
constexpr bool kHasThreads = true;
#endif

// One call of `run`.
struct ThreadPool::Loop {
    bool open() const { return next < count; }

    const std::function<void(std::size_t, std::size_t)> &work;
    const std::size_t count;
    const std::atomic<bool> *const cancelled = CancellationScope::current();
    std::atomic<std::size_t> next{0};
    std::size_t helpers = 0;         // workers in the loop; guarded by the pool's mutex_
    std::exception_ptr failure = {}; // likewise
};

ThreadPool::ThreadPool(int threads) {
    assert(threads >= 1);
    workers_.reserve(static_cast<std::size_t>(threads) - 1);
    try {
        for (std::size_t thread = 1; kHasThreads && thread < static_cast<std::size_t>(threads); ++thread)
            workers_.emplace_back([this, thread] { serve(thread); });
    } catch (...) { // no more threads, or no memory for them
    }
}

ThreadPool::~ThreadPool() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    more_.notify_all();
    for (std::thread &worker : workers_)
        worker.join();
}

void ThreadPool::run(std::size_t count, const std::function<void(std::size_t, std::size_t)> &work) {
    Loop loop{.work = work, .count = count};
    if (count > 1 && !workers_.empty()) {
        {
            const std::lock_guard lock(mutex_);
            loop_ = &loop;
        }
        more_.notify_all();
    }
    take_items(loop, 0);
    std::unique_lock lock(mutex_);
    loop_ = nullptr; // workers that wake up late find no loop
    end_.wait(lock, [&] { return loop.helpers == 0; });
    if (loop.failure)
        std::rethrow_exception(loop.failure);
}

void ThreadPool::take_items(Loop &loop, std::size_t thread) {
    try {
        const CancellationScope scope(loop.cancelled);
        for (std::size_t i = loop.next++; i < loop.count; i = loop.next++) {
            check_cancelled();
            loop.work(i, thread);
        }
    } catch (...) {
        const std::lock_guard lock(mutex_);
        if (!loop.failure)
            loop.failure = std::current_exception();
        loop.next = loop.count;
    }
}

void ThreadPool::serve(std::size_t thread) {
    const auto loop_open = [this] { return loop_ != nullptr && loop_->open(); };
    std::unique_lock lock(mutex_);
    while (true) {
        // Others take items of a loop without the mutex: it is open or not once, here.
        bool open = false;
        more_.wait(lock, [&] { return stop_ || (open = loop_open()) || !queue_.empty(); });
        if (stop_)
            return;
        if (open) {
            Loop &loop = *loop_;
            ++loop.helpers;
            lock.unlock();
            take_items(loop, thread);
            lock.lock();
            if (--loop.helpers == 0)
                end_.notify_one();
        } else {
            std::function<void()> work = std::move(queue_.front());
            queue_.pop_front();
            lock.unlock();
            work();
            work = nullptr; // frees its captures before posted_ changes
            lock.lock();
            --posted_;
            if (wake_)
                wake_();
        }
    }
}

void ThreadPool::add(std::function<void()> work) {
    if (workers_.empty()) {
        work();
        wake();
        return;
    }
    {
        const std::lock_guard lock(mutex_);
        queue_.push_back(std::move(work));
        ++posted_;
    }
    more_.notify_one();
}

bool ThreadPool::busy() const {
    const std::lock_guard lock(mutex_);
    return posted_ > 0;
}

void ThreadPool::set_wake(std::function<void()> wake) {
    const std::lock_guard lock(mutex_);
    wake_ = std::move(wake);
}

void ThreadPool::wake() const {
    const std::lock_guard lock(mutex_);
    if (wake_)
        wake_();
}

} // namespace pbm
