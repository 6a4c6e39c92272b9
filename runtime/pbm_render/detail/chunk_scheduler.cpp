#include "pbm_render/detail/chunk_scheduler.h"

#include "system/threads/parallel.h"

#include <algorithm>
#include <new>
#include <string>
#include <utility>

namespace pbm {

ChunkScheduler::ChunkScheduler(const ChunkLoader &loader, ChunkCache &cache, std::mutex &mutex, int threads,
                               std::shared_ptr<ThreadPool> pool, std::function<void()> arrived)
    : loader_(loader), cache_(cache), thread_count_(resolve_threads(threads)), arrived_(std::move(arrived)),
      mutex_(mutex), pool_(std::move(pool)) {}

ChunkScheduler::~ChunkScheduler() {
    {
        const std::lock_guard lock(mutex_);
        stopped_ = true;
    }
    changed_.notify_all();
}

Status ChunkScheduler::load_all(std::vector<MissingChunk> missing, FramePointer frame) {
    const auto threads = std::clamp<std::size_t>(missing.size(), 1, static_cast<std::size_t>(thread_count_));
    {
        const std::lock_guard lock(mutex_);
        enqueue(std::move(missing), std::move(frame));
    }
    if (threads > 1 && pool_ == nullptr)
        pool_ = std::make_shared<ThreadPool>(thread_count_);
    if (threads > 1)
        pool_->run(threads, [this](std::size_t, std::size_t) { work(true); });
    else
        work(true);
    const std::lock_guard lock(mutex_);
    const std::vector<Error> errors = take_errors();
    if (!errors.empty())
        return *std::min_element(errors.begin(), errors.end(),
                                 [](const Error &a, const Error &b) { return a.offset < b.offset; });
    if (full_)
        return Error{ErrorCode::memory, 0,
                     "the picture needs more memory than allowed (" + std::to_string(cache_.max_memory() >> 20) +
                         " MiB)"};
    return {};
}

void ChunkScheduler::request(std::vector<MissingChunk> missing, FramePointer frame) {
    {
        const std::lock_guard lock(mutex_);
        enqueue(std::move(missing), std::move(frame));
    }
    changed_.notify_all();
    if (!threads_)
        threads_.emplace(thread_count_ + 1); // the calling thread does not take part
    for (; loops_ < threads_->threads() - 1; ++loops_)
        threads_->post([this] { work(false); });
    if (threads_->threads() == 1) {
        work(true);
        if (arrived_)
            arrived_();
    }
}

bool ChunkScheduler::is_loading() const {
    const std::lock_guard lock(mutex_);
    return loading_ > 0 || find_next() < queue_.size();
}

// Loads the queued chunks. Returns when they are done or, unless `until_done`, when the scheduler stops.
void ChunkScheduler::work(bool until_done) {
    std::unique_lock lock(mutex_);
    while (!stopped_) {
        if (std::optional<ChunkTask> task = take_task()) {
            lock.unlock();
            Result<ResidentPointer> loaded = loader_.load(*task);
            lock.lock();
            finish(*task, std::move(loaded));
            if (!until_done && arrived_) {
                lock.unlock();
                arrived_();
                lock.lock();
            }
        } else if (until_done && loading_ == 0) {
            return;
        } else {
            changed_.wait(lock,
                          [&] { return stopped_ || find_next() < queue_.size() || (until_done && loading_ == 0); });
        }
    }
}

void ChunkScheduler::enqueue(std::vector<MissingChunk> missing, FramePointer frame) {
    queue_ = std::move(missing);
    frame_ = std::move(frame);
    queue_start_ = 0;
    full_ = false;
}

// Index of the first queued chunk that a thread can load now; the queue's size if there is none.
std::size_t ChunkScheduler::find_next() const {
    if (full_)
        return queue_.size();
    const auto can_be_loaded = [&](const MissingChunk &chunk) {
        return !cache_.is_settled(chunk.place) && cache_.has_parent(chunk.place) && loader_.has_bytes(chunk.place);
    };
    return static_cast<std::size_t>(
        std::find_if(queue_.begin() + static_cast<std::ptrdiff_t>(queue_start_), queue_.end(), can_be_loaded) -
        queue_.begin());
}

std::optional<ChunkTask> ChunkScheduler::take_task() try {
    while (queue_start_ < queue_.size() && cache_.is_settled(queue_[queue_start_].place))
        ++queue_start_;
    const std::size_t next = find_next();
    if (next == queue_.size())
        return std::nullopt;
    const ChunkPlace place = queue_[next].place;
    std::optional<StoredChunk> bytes = loader_.bytes_of(place);
    if (!bytes) // dropped by another thread: the next view wants it again
        return std::nullopt;
    std::optional<ChunkTask> task = cache_.begin_loading(place, loader_);
    if (task) {
        task->bytes = std::move(*bytes);
        task->frame = queue_[next].is_shown ? frame_ : nullptr;
        loader_.drop_bytes(place);
        ++loading_;
    } else {
        full_ = true;
    }
    return task;
} catch (const std::bad_alloc &) {
    full_ = true;
    return std::nullopt;
}

void ChunkScheduler::finish(const ChunkTask &task, Result<ResidentPointer> loaded) {
    --loading_;
    bytes_read_ += loader_.bytes_read_by(*task.entry);
    points_decoded_ += loaded ? loader_.points_decoded_by(*task.entry) : 0;
    cache_.finish_loading(task, loaded ? *loaded : nullptr);
    if (!loaded)
        add_error(std::move(loaded).error());
    changed_.notify_all();
}

// Called by background threads, where an exception would be lost.
void ChunkScheduler::add_error(Error error) try {
    errors_.push_back(std::move(error));
} catch (const std::bad_alloc &) {
    full_ = true;
}

} // namespace pbm
