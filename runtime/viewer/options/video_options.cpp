#include "viewer/options/video_options.h"

#include "command_line/common_options.h"

#include <filesystem>

namespace pbm {

void add_video_options(CLI::App &app, VideoChoice &choice) {
    app.option_defaults()->group("Video");
    app.add_option("--turntable", choice.video.output,
                   "Once round the focal point, about the model's up axis, as .avi, .mp4 (runs ffmpeg), pictures "
                   "(name_%04d.png or .bmp) or - for raw RGB frames")
        ->type_name("FILE");
    app.add_flag("--avi", choice.avi, "The same as MODEL.avi in this folder");
    app.add_option("--frames", choice.video.frames, "Of the video")
        ->check(CLI::Range(1, kMaxFrames))
        ->capture_default_str();
    app.add_option("--fps", choice.video.fps, "Frames per second of the video")
        ->check(CLI::Range(1.0, 240.0))
        ->capture_default_str();
    app.add_option("--video-quality", choice.video.quality, "Of the frames of .avi, 1..100")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    app.option_defaults()->group("Options");
}

Status complete_video(VideoChoice &choice, const std::string &model, const RenderOptions &render) {
    std::string &output = choice.video.output;
    if (choice.avi && !output.empty())
        return Error{ErrorCode::usage, 0, "--avi and --turntable both name a video; keep one of them"};
    if (choice.avi)
        output = (model.empty() ? "sample" : std::filesystem::path(model).stem().string()) + ".avi";
    if (output.empty())
        return {};
    if (Status known = check_video_name(output); !known)
        return known;
    if (render.background[3] == 0 && !has_transparency(output))
        return Error{ErrorCode::usage, 0,
                     output + ": videos have no transparency; choose pictures (name_%04d.png) or leave out "
                              "--no-background"};
    return {};
}

} // namespace pbm
