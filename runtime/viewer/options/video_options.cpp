#include "viewer/options/video_options.h"

#include "command_line/parse.h"

#include <filesystem>
#include <utility>

namespace pbm {

void add_video_options(command_line::CommandLine &line, VideoChoice &choice) {
    line.topic = "Video";
    line.add("--turntable",
             "Once round the focal point, about the model's up axis, as .avi, .mp4 (runs ffmpeg), pictures "
             "(name_%04d.png or .bmp) or - for raw RGB frames",
             &choice.video.output, {.type = "FILE"});
    line.add("--avi", "The same as MODEL.avi in this folder", &choice.avi);
    line.add("--frames", "Of the video", &choice.video.frames,
             {.check = command_line::Integers{1, kMaxFrames}, .shows_default = true});
    line.add("--fps", "Frames per second of the video", &choice.video.fps,
             {.check = command_line::Numbers{1, 240}, .shows_default = true});
    line.add("--video-quality", "Of the frames of .avi, 1..100", &choice.video.quality,
             {.check = command_line::Integers{1, 100}, .shows_default = true});
    line.topic = "Options";
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

std::vector<command_line::OutputFile> video_outputs(const VideoOptions &video) {
    std::vector<command_line::OutputFile> outputs;
    for (std::string &name : video_files(video))
        outputs.push_back({"--turntable", std::move(name)});
    return outputs;
}

} // namespace pbm
