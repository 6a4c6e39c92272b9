// Opens a file in the background: builds the model of a scan first.
#pragma once

#include "system/threads/thread_pool.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/scene/shown_model.h"

#include <chrono>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

namespace pbm {

class Opening {
  public:
    struct Progress {
        std::string step; // of pbm-build
        double done = 0;  // 0..1 of the step
    };

    // Starts at once on `pool`, which must outlive this object and the model; its `wake` is called when there is
    // progress, when it ends, and when chunks of the model arrive.
    // `draws_first`: there is no window yet, so the model's first picture is drawn, too, until `hurry`.
    Opening(ThreadPool &pool, std::string path, const ViewOptions &options, const ScanOptions &scans,
            bool draws_first = false);
    // Cancels. Does not wait for a model that is loaded.
    ~Opening();
    Opening(const Opening &) = delete;
    Opening &operator=(const Opening &) = delete;

    const std::string &path() const { return path_; }
    bool is_ready() const { return pbm::is_ready(opened_); }
    // Once, when it is ready. The error has advice for a user of `program`.
    Result<ShownModelPointer> take() { return opened_.get(); }

    // The window is there: waits for the first picture if it is being drawn; if its chunks are still loaded, the window
    // shows them as they arrive.
    void hurry();

    // Why the cache of models was not used, once it is ready; empty otherwise.
    std::string warning() const;

    // While pbm-build runs.
    std::optional<Progress> progress() const;
    // Ends pbm-build. Loading goes on.
    void cancel() { stop_.request_stop(); }
    bool was_cancelled() const { return stop_.stop_requested(); }

  private:
    struct Shared {
        void set(bool Shared::*flag) {
            const std::lock_guard lock(mutex);
            this->*flag = true;
            changed.notify_all();
        }
        // Waits until chunks arrive, briefly, since those that fail do not. Returns false once the window is there.
        bool wait_for_chunks() {
            std::unique_lock lock(mutex);
            changed.wait_for(lock, std::chrono::milliseconds(5), [&] { return hurries || arrived; });
            arrived = false;
            return !hurries;
        }

        std::mutex mutex; // guards what follows
        std::condition_variable changed;
        bool arrived = false, hurries = false, draws = false;
        std::optional<Progress> progress;
        std::string warning;
    };

    const std::string path_;
    std::stop_source stop_;
    const std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
    std::future<Result<ShownModelPointer>> opened_;
};

} // namespace pbm
