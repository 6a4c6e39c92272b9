// The fine picture of a view at rest, sample by sample on the background thread: each is shown, and between two of them
// it can be given up.
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
        int samples; // it is the mean of
    };

    // Works on `background`, which must outlive it, and begins at once. `detail` was chosen for `view`, nothing
    // missing.
    Refinement(ThreadPool &background, ShownModelPointer model, Detail detail, const DetailView &view,
               LookPointer look);
    // The sample under way is not waited for.
    ~Refinement() = default;
    Refinement(const Refinement &) = delete;
    Refinement &operator=(const Refinement &) = delete;

    // The next picture if it is there; the one after it is then begun, if the look asks for more samples.
    std::optional<Picture> receive();
    bool done() const { return !next_.valid(); }

  private:
    // What a sample under way needs, whether it is still wanted or not.
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
