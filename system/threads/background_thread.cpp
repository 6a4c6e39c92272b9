#include "system/threads/background_thread.h"

namespace pbm {

BackgroundThread::BackgroundThread() : thread_([this](const std::stop_token &stop) { run(stop); }) {}

BackgroundThread::~BackgroundThread() = default; // std::jthread asks to stop, and waits

void BackgroundThread::set_wake(std::function<void()> wake) {
    const std::lock_guard lock(mutex_);
    wake_ = std::move(wake);
}

void BackgroundThread::wake() const {
    const std::lock_guard lock(mutex_);
    if (wake_)
        wake_();
}

bool BackgroundThread::busy() const {
    const std::lock_guard lock(mutex_);
    return working_ || !queue_.empty();
}

void BackgroundThread::add(std::function<void()> work) {
    {
        const std::lock_guard lock(mutex_);
        queue_.push_back(std::move(work));
    }
    more_.notify_one();
}

void BackgroundThread::run(const std::stop_token &stop) {
    std::unique_lock lock(mutex_);
    while (more_.wait(lock, stop, [this] { return !queue_.empty(); }) && !stop.stop_requested()) {
        std::function<void()> work = std::move(queue_.front());
        queue_.pop_front();
        working_ = true;
        lock.unlock();
        work();
        work = nullptr; // what it holds is freed here, not under the lock
        lock.lock();
        working_ = false;
        if (wake_)
            wake_();
    }
}

} // namespace pbm
