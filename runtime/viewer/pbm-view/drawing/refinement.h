// Refines the picture of a view at rest on the background thread. The first sample yields a picture, and all others
// together another one; the refinement's end interrupts those in progress.
#pragma once

#include "system/threads/thread_pool.h"
#include "viewer/pbm-view/drawing/picture_memory.h"
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
    Refinement(ThreadPool &background, ShownModelPointer model, Detail detail, const DetailView &view, LookPointer look,
               std::shared_ptr<PictureMemory> memory)
        : background_(background),
          work_(std::make_shared<Work>(std::move(model), std::move(detail), view, std::move(look), std::move(memory))) {
        add_samples(0, 1);
    }
    // Does not wait for the sample in progress, which leaves the processors to the next picture.
    ~Refinement() { work_->stop = true; }
    Refinement(const Refinement &) = delete;
    Refinement &operator=(const Refinement &) = delete;

    bool is_ready() const { return pbm::is_ready(next_); }
    // The next picture, which is ready.
    Picture receive() { return next_.get(); }
    // Starts the one after a picture of `samples` if the look asks for more.
    void go_on(int samples) {
        if (const int missing = work_->look->options.samples - samples; missing > 0)
            add_samples(samples, missing);
    }

  private:
    // Data of the sample in progress, which may outlive the refinement.
    struct Work {
        Work(ShownModelPointer m, Detail d, const DetailView &v, LookPointer l, std::shared_ptr<PictureMemory> p)
            : model(std::move(m)), detail(std::move(d)), view(v), look(std::move(l)), memory(std::move(p)) {}

        const ShownModelPointer model;
        const Detail detail;
        const DetailView view;
        const LookPointer look;
        const std::shared_ptr<PictureMemory> memory;
        bool begun = false;
        std::atomic<bool> stop = false;
    };
    // What remains of a picture that nobody receives.
    static Picture given_back(const Work &work, Picture picture) {
        work.memory->give(std::move(picture.pixels));
        return picture;
    }
    // Adds samples to a picture of `samples`.
    void add_samples(int samples, int count) {
        next_ = background_.post([work = work_, samples, count] {
            Picture picture{work->memory->take({work->view.width, work->view.height}), {}, samples + count};
            if (work->stop)
                return given_back(*work, std::move(picture));
            if (!std::exchange(work->begun, true))
                work->model->begin_fine(work->detail, work->view, work->look, picture.pixels);
            picture.drawn = work->model->add_samples(work->detail, work->view, count, picture.pixels, &work->stop);
            if (work->stop)
                return given_back(*work, std::move(picture));
            return picture;
        });
    }

    ThreadPool &background_;
    const std::shared_ptr<Work> work_;
    std::future<Picture> next_;
};

} // namespace pbm
