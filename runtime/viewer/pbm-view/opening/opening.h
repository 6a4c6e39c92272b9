// Opens a file in the background: builds the model of a scan first.
#pragma once

#include "system/threads/thread_pool.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/scene/shown_model.h"

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
    Opening(ThreadPool &pool, std::string path, const ViewOptions &options, const ScanOptions &scans);
    // Cancels. Does not wait for a model that is loaded.
    ~Opening();
    Opening(const Opening &) = delete;
    Opening &operator=(const Opening &) = delete;

    const std::string &path() const { return path_; }
    bool is_ready() const { return pbm::is_ready(opened_); }
    // Once, when it is ready. The error has advice for a user of `program`.
    Result<ShownModelPointer> take() { return opened_.get(); }

    // Why the cache of models was not used, once it is ready; empty otherwise.
    std::string warning() const;

    // While pbm-build runs.
    std::optional<Progress> progress() const;
    // Ends pbm-build. Loading goes on.
    void cancel() { stop_.request_stop(); }
    bool was_cancelled() const { return stop_.stop_requested(); }

  private:
    struct Shared {
        std::mutex mutex;
        std::optional<Progress> progress;
        std::string warning;
    };

    const std::string path_;
    std::stop_source stop_;
    const std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
    std::future<Result<ShownModelPointer>> opened_;
};

} // namespace pbm
