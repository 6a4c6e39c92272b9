// Refines the picture of a view at rest, sample by sample on the background thread. Each sample yields a picture;
// refinement can end between two samples.
#pragma once

#include "system/threads/thread_pool.h"
#include "viewer/scene/shown_model.h"

#include <future>
#include <memory>
#include <optional>

namespace pbm {

class Refinement {
  public:
    struct Picture {
        Framebuffer pixels;
        PictureStatistics drawn;
        int samples; // that `pixels` is the mean of
    };

    // Starts at once on `background`, which must outlive this object. `detail` was chosen for `view`, nothing missing.
    Refinement(ThreadPool &background, ShownModelPointer model, Detail detail, const DetailView &view,
               LookPointer look);
    // Does not wait for the sample in progress.
    ~Refinement() = default;
    Refinement(const Refinement &) = delete;
    Refinement &operator=(const Refinement &) = delete;

    // The next picture if it is ready; starts the one after it if the look asks for more samples.
    std::optional<Picture> receive();
    bool done() const { return !next_.valid(); }

  private:
    // Data of the sample in progress, which may outlive the refinement.
    struct Work {
        ShownModelPointer model;
        Detail detail;
        DetailView view;
        LookPointer look;
        bool begun = false;
    };
    void add_sample(int samples);

    ThreadPool &background_;
    const std::shared_ptr<Work> work_;
    std::future<Picture> next_;
};

} // namespace pbm
