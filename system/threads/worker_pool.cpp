#include "system/threads/worker_pool.h"

#include <cassert>
#include <system_error>
#include <utility>

namespace pbm {

WorkerPool::WorkerPool(int threads) {
    assert(threads >= 1);
    workers_.reserve(static_cast<std::size_t>(threads) - 1);
    for (std::size_t i = 1; i < static_cast<std::size_t>(threads); ++i)
        try {
            workers_.emplace_back([this, i] { serve(i); });
        } catch (const std::system_error &) { // no more threads to be had: fewer do the same work
            break;
        }
}

WorkerPool::~WorkerPool() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    begin_.notify_all();
}

void WorkerPool::run(std::size_t count, const std::function<void(std::size_t, std::size_t)> &work) {
    if (workers_.empty() || count <= 1) {
        for (std::size_t i = 0; i < count; ++i)
            work(i, 0);
        return;
    }
    {
        const std::lock_guard lock(mutex_);
        work_ = &work;
        count_ = count;
        next_ = 0;
        busy_ = workers_.size();
        ++round_;
    }
    begin_.notify_all();
    take_items(0);
    std::unique_lock lock(mutex_);
    end_.wait(lock, [&] { return busy_ == 0; });
    if (failure_)
        std::rethrow_exception(std::exchange(failure_, nullptr));
}

void WorkerPool::serve(std::size_t thread) {
    std::size_t served = 0;
    std::unique_lock lock(mutex_);
    while (true) {
        begin_.wait(lock, [&] { return stop_ || round_ != served; });
        if (stop_)
            return;
        served = round_;
        lock.unlock();
        take_items(thread);
        lock.lock();
        if (--busy_ == 0)
            end_.notify_one();
    }
}

void WorkerPool::take_items(std::size_t thread) {
    try {
        for (std::size_t i = next_++; i < count_; i = next_++)
            (*work_)(i, thread);
    } catch (...) {
        const std::lock_guard lock(mutex_);
        failure_ = std::current_exception();
        next_ = count_;
    }
}

} // namespace pbm
