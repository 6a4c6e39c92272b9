#include "turntable.h"

#include "viewer/scene/camera_control.h"

#include <glm/gtc/constants.hpp>

#include <chrono>
#include <filesystem>
#include <system_error>

namespace pbm {

RecordedVideo record_turntable(ModelDrawer &drawer, VideoRecorder &recorder, const VideoOptions &video,
                               const Camera &first, const std::function<void(int frame, const Camera &)> &begun) {
    const auto begin = std::chrono::steady_clock::now();
    const glm::dvec3 axis = up_direction(drawer.grid().up);
    RecordedVideo result;
    for (int frame = 0; frame < video.frames && result.file; ++frame) {
        const Camera camera = turntable(first, axis, glm::two_pi<double>() * frame / video.frames);
        begun(frame, camera);
        const Framebuffer &canvas = recorder.canvas();
        result.model = drawer.load(camera, {canvas.width, canvas.height});
        if (!result.model)
            return result;
        drawer.draw(camera, recorder.canvas());
        result.model = drawer.damage();
        if (!result.model)
            return result;
        result.file = recorder.add();
    }
    if (result.file)
        result.file = recorder.finish();
    // ffmpeg's output is a file of another size than the frames.
    std::error_code no_single_file;
    const auto size = std::filesystem::file_size(video.output, no_single_file);
    result.bytes = no_single_file ? recorder.bytes() : size;
    result.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    return result;
}

} // namespace pbm
