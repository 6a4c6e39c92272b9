#include "viewer/scene/picture_saver.h"

#include "viewer/pictures/picture_file.h"

#include <algorithm>
#include <filesystem>
#include <utility>

namespace pbm {

void PictureSaver::serve() {
    while (!waiting_.empty()) {
        Waiting &picture = waiting_.front();
        StreamedModel &model = picture.model->streamed();
        const bool is_loading = model.is_loading(); // before choosing: chunks that arrive in between are chosen
        Detail detail = model.choose(picture.view);
        if (detail.missing.empty() || (picture.requested && !is_loading)) {
            begin(picture, std::move(detail));
            waiting_.pop_front();
            continue;
        }
        // Pictures that are being drawn hold their chunks: only without them a lack of memory is final.
        picture.requested = picture.requested || std::all_of(saving_.begin(), saving_.end(), is_ready<Saved>);
        model.request(std::move(detail.missing));
        return;
    }
}

void PictureSaver::begin(const Waiting &picture, Detail detail) {
    saving_.push_back(background_.post([model = picture.model, view = picture.view, look = picture.look,
                                        detail = std::move(detail)]() mutable -> Saved {
        const Detail drawn = std::move(detail); // does not outlive the call
        if (!drawn.missing.empty())
            return Error{ErrorCode::memory, 0, "the picture needs more memory than allowed"};
        Framebuffer pixels(view.width, view.height, false);
        if (model->draw_still(drawn, view, look, pixels).is_lost)
            return Error{ErrorCode::io, 0, "no picture was saved: the file of the model was written over"};
        return save_picture(std::filesystem::path(), std::filesystem::path(model->path()).stem().string(), pixels);
    }));
}

std::vector<PictureSaver::Saved> PictureSaver::take_done(bool all) {
    if (all)
        for (; !waiting_.empty(); waiting_.pop_front()) {
            StreamedModel &model = waiting_.front().model->streamed();
            static_cast<void>(model.load(waiting_.front().view)); // coarser levels replace what is damaged
            begin(waiting_.front(), model.choose(waiting_.front().view));
        }
    std::vector<Saved> done;
    while (!saving_.empty() && (all || is_ready(saving_.front()))) {
        done.push_back(saving_.front().get());
        saving_.pop_front();
    }
    return done;
}

} // namespace pbm
