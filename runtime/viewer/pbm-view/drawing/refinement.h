// Refines the picture of a view at rest on the background thread. The first sample yields a picture, and all others
// together another one; the refinement's end interrupts those in progress.
#pragma once

#include "system/threads/thread_pool.h"
#include "viewer/scene/shown_model.h"

#include <atomic>
#include <future>
#include <memory>
#include <optional>
#include <utility>

namespace pbm {

class Refinement {
  public:
    struct Picture {
        Framebuffer pixels;
        PictureStatistics drawn;
        int samples; // that `pixels` is the mean of
    };

    // Starts at once on `background`, which must outlive this object. `detail` was chosen for `view`, nothing missing.
    Refinement(ThreadPool &background, ShownModelPointer model, Detail detail, const DetailView &view, LookPointer look)
        : background_(background),
          work_(std::make_shared<Work>(std::move(model), std::move(detail), view, std::move(look))) {
        add_samples(0, 1);
    }
    // Does not wait for the sample in progress, which leaves the processors to the next picture.
    ~Refinement() { work_->stop = true; }
    Refinement(const Refinement &) = delete;
    Refinement &operator=(const Refinement &) = delete;

    // The next picture if it is ready; starts the one after it if the look asks for more samples.
    std::optional<Picture> receive() {
        if (!is_ready(next_))
            return std::nullopt;
        Picture picture = next_.get();
        if (const int missing = work_->look->options.samples - picture.samples; missing > 0)
            add_samples(picture.samples, missing);
        return picture;
    }

  private:
    // Data of the sample in progress, which may outlive the refinement.
    struct Work {
        Work(ShownModelPointer m, Detail d, const DetailView &v, LookPointer l)
            : model(std::move(m)), detail(std::move(d)), view(v), look(std::move(l)) {}

        const ShownModelPointer model;
        const Detail detail;
        const DetailView view;
        const LookPointer look;
        bool begun = false;
        std::atomic<bool> stop = false;
    };
    // Adds samples to a picture of `samples`.
    void add_samples(int samples, int count) {
        next_ = background_.post([work = work_, samples, count] {
            Picture picture{Framebuffer(work->view.width, work->view.height), {}, samples + count};
            if (work->stop)
                return picture; // nobody receives it
            if (!std::exchange(work->begun, true))
                work->model->begin_fine(work->detail, work->view, work->look);
            picture.drawn = work->model->add_samples(work->detail, work->view, count, picture.pixels, &work->stop);
            return picture;
        });
    }

    ThreadPool &background_;
    const std::shared_ptr<Work> work_;
    std::future<Picture> next_;
};

} // namespace pbm
