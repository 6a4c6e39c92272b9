#include "recording.h"

#include "viewer/scene/camera_control.h"

#include <glm/gtc/constants.hpp>

#include <utility>

namespace pbm {

Recording::Recording(VideoSink sink, const VideoOptions &video, const ViewOptions &view, const Camera &first,
                     glm::dvec3 axis)
    : video_(video), view_(view), first_(first), axis_(axis),
      recorder_(std::move(sink), view.resolution, false, view.load.threads, view.load.max_memory) {}

Camera Recording::camera() const { return turntable(first_, axis_, glm::two_pi<double>() * frame_ / video_.frames); }

Status Recording::add(ShownModel &model, const LookPointer &look,
                      const std::function<void(const Framebuffer &, const PictureStatistics &)> &show) {
    const DetailView view = model.view(camera(), view_.resolution, view_.max_error);
    const auto detail = model.streamed().load(view);
    if (!detail)
        return detail.error();
    const PictureStatistics drawn = model.draw_and_wait(*detail, view, look, recorder_.canvas());
    show(recorder_.canvas(), drawn);
    ++frame_;
    return recorder_.add();
}

} // namespace pbm
