// Loads chunks into a cache on several threads: most urgent first, and each after its parent.
#pragma once

#include "pbm_render/detail/chunk_cache.h"
#include "system/threads/thread_pool.h"

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

namespace pbm {

class ChunkScheduler {
  public:
    // `mutex` guards `cache`; every user of the cache holds it. `threads`: 0 asks for one per processor. `pool` runs
    // load_all; null: a pool of that many threads, started when it is needed. Background threads call `arrived` after
    // each chunk. All references must outlive the scheduler.
    ChunkScheduler(const ChunkLoader &loader, ChunkCache &cache, std::mutex &mutex, int threads,
                   std::shared_ptr<ThreadPool> pool, std::function<void()> arrived);
    // Waits for the chunks that are being loaded.
    ~ChunkScheduler();

    // Loads all of these chunks before it returns. After an error it continues with the other chunks. `frame`: the
    // picture that they are for, if any of them is shown; null: none.
    //
    // errors  as ChunkLoader::load, the one with the lowest offset; memory: they do not fit
    Status load_all(std::vector<MissingChunk> missing, FramePointer frame);

    // Loads these chunks in the background until all are resident or no more fit. They replace chunks of earlier calls
    // that no thread has started. If the system gives no thread, it loads them before it returns.
    void request(std::vector<MissingChunk> missing, FramePointer frame);
    // Whether a requested chunk is still to come.
    bool is_loading() const;

    // The caller holds the mutex:
    void add_error(Error error);
    std::vector<Error> take_errors() { return std::exchange(errors_, {}); }
    std::uint64_t bytes_read() const { return bytes_read_; }
    std::uint64_t points_decoded() const { return points_decoded_; }

  private:
    void work(bool until_done);
    // The caller holds the mutex:
    void enqueue(std::vector<MissingChunk> missing, FramePointer frame);
    std::size_t find_next() const;
    std::optional<ChunkTask> take_task();
    void finish(const ChunkTask &task, Result<ResidentPointer> loaded);

    const ChunkLoader &loader_;
    ChunkCache &cache_;
    const int thread_count_;
    const std::function<void()> arrived_;

    std::mutex &mutex_; // of all below but the threads
    std::condition_variable changed_;
    std::vector<MissingChunk> queue_;
    FramePointer frame_;          // that the queued chunks are for
    std::size_t queue_start_ = 0; // the chunks before it are settled
    int loading_ = 0;             // chunks
    bool full_ = false;           // the next queued chunk does not fit
    bool stopped_ = false;
    std::vector<Error> errors_;
    std::uint64_t bytes_read_ = 0, points_decoded_ = 0;

    int loops_ = 0;                     // running calls of `work`
    std::shared_ptr<ThreadPool> pool_;  // of load_all
    std::optional<ThreadPool> threads_; // of request; last member: its work uses the others
};

} // namespace pbm
