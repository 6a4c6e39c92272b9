#include "sequence.h"

#include "system/files/file_replacement.h"
#include "viewer/pictures/exr_writer.h"

#include <chrono>
#include <filesystem>
#include <string>

namespace pbm {
namespace {

bool is_there(const std::string &file) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(file, ignored) && std::filesystem::file_size(file, ignored) > 0;
}

Result<Bytes> draw_frame(const Sequence &sequence, int frame, const ViewOptions &view, ModelDrawer &drawer,
                         std::ostream *views) {
    const ViewOptions seen = view_at(sequence.path, frame_time(sequence.path, frame, sequence.fps), drawer.extent(),
                                     up_of(view, drawer.grid()), view);
    const auto camera = choose_camera(seen, drawer.extent(), drawer.grid(), view.resolution);
    if (!camera)
        return flat_camera();
    if (views != nullptr)
        *views << "frame " << frame << ": " << view_as_options(*camera, seen, view.resolution)
               << look_as_options(look_of(Motion::still, view.look)) << '\n';
    if (Status loaded = drawer.load(*camera, view.resolution, Motion::still); !loaded)
        return std::move(loaded).error();
    return draw_file(drawer, *camera, view, sequence.form);
}

} // namespace

Error flat_camera() {
    return {ErrorCode::bad_input, 0, "the camera sees nothing: a scale or an angle of it is 0, or a number is missing"};
}

Result<Bytes> draw_file(ModelDrawer &drawer, const Camera &camera, const ViewOptions &view, PictureForm form) {
    const glm::ivec2 size = view.resolution;
    if (form == PictureForm::exr) {
        RenderStatistics drawn;
        const PictureLayers layers = drawer.draw_layers(camera, size, Motion::still, drawn);
        const Status whole = drawer.damage();
        return whole ? encode_exr(layers) : Result<Bytes>(whole.error());
    }
    Framebuffer picture(size.x, size.y, drawer.needs_depths());
    drawer.draw(camera, picture, Motion::still);
    const Status whole = drawer.damage();
    if (!whole)
        return whole.error();
    Result<Bytes> file = encode_picture(picture, form, view.load.threads);
    if (file && view.look.finish.dpi != 0)
        set_dpi(view.look.finish.dpi, form, *file);
    return file;
}

Result<SequenceStatistics> draw_sequence(const Sequence &sequence, const ViewOptions &view, ModelDrawer &drawer,
                                         command_line::ProgressDisplay &progress, std::ostream *views) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    const FrameRange frames = sequence.frames;
    SequenceStatistics statistics;
    for (int frame = frames.first; frame <= frames.last; ++frame) {
        const std::string file = sequence.names.of(frame);
        progress.show("frames", static_cast<double>(frame - frames.first) / (frames.last - frames.first + 1));
        if (sequence.resume && is_there(file)) {
            ++statistics.kept;
            continue;
        }
        const auto in_frame = [&](Error error) {
            error.message.insert(0, "frame " + std::to_string(frame) + ": ");
            return error;
        };
        const auto bytes = draw_frame(sequence, frame, view, drawer, views);
        if (!bytes)
            return in_frame(bytes.error());
        if (const Status written = replace_file(file, *bytes, Durability::cached); !written)
            return in_frame({written.error().code, 0, file + ": " + written.error().message});
        ++statistics.drawn;
        statistics.bytes += bytes->size();
    }
    statistics.ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    return statistics;
}

} // namespace pbm
