#include "refinement.h"

#include <utility>

namespace pbm {

Refinement::Refinement(ThreadPool &background, ShownModelPointer model, Detail detail, const DetailView &view,
                       LookPointer look)
    : background_(background),
      work_(std::make_shared<Work>(Work{std::move(model), std::move(detail), view, std::move(look)})) {
    add_sample(1);
}

std::optional<Refinement::Picture> Refinement::receive() {
    if (!is_ready(next_))
        return std::nullopt;
    Picture picture = next_.get();
    if (picture.samples < work_->look->options.samples)
        add_sample(picture.samples + 1);
    return picture;
}

void Refinement::add_sample(int samples) {
    next_ = background_.post([work = work_, samples] {
        Picture picture{Framebuffer(work->view.width, work->view.height, false), {}, samples};
        if (!std::exchange(work->begun, true))
            work->model->begin_fine(work->detail, work->view, work->look);
        picture.drawn = work->model->add_sample(work->detail, work->view, picture.pixels);
        return picture;
    });
}

} // namespace pbm
