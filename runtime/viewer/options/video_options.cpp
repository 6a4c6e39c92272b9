#include "viewer/options/video_options.h"

#include "command_line/parse.h"

#include <charconv>
#include <filesystem>
#include <string_view>
#include <utility>

namespace pbm {
namespace {

// "N", frames 1 to N, or "FIRST-LAST".
Result<FrameRange> parse_frames(const std::string &text) {
    const auto number = [](std::string_view digits) {
        int value = 0;
        const auto [at, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        return error == std::errc() && at == digits.data() + digits.size() && value <= kMaxFrames ? value : 0;
    };
    const std::size_t dash = text.find('-');
    const FrameRange frames{dash == std::string::npos ? 1 : number(std::string_view(text).substr(0, dash)),
                            number(std::string_view(text).substr(dash + 1))}; // all of it without a dash
    if (frames.first >= 1 && frames.last >= frames.first)
        return frames;
    return usage_error("'" + text + "' are no frames; write 1 to " + std::to_string(kMaxFrames) +
                       ", or a part like 21-40");
}

} // namespace

void add_video_options(command_line::CommandLine &line, VideoChoice &choice) {
    line.topic = "Video";
    line.add("--turntable",
             "Once round the focal point, about the model's up axis, as .avi, .mp4 (runs ffmpeg), pictures "
             "(name_%04d.png) or - for raw RGB frames",
             &choice.video.output, {.type = "FILE"});
    line.add("--avi", "The same as MODEL.avi in this folder", &choice.avi);
    line.add("--frames", "Of the turntable, default 120; FIRST-LAST: these of a sequence",
             [&choice](const std::string &text) -> Status {
                 const auto frames = parse_frames(text);
                 if (!frames)
                     return frames.error();
                 if (text.find('-') == std::string::npos)
                     choice.video.frames = frames->last;
                 else
                     choice.part = *frames;
                 return {};
             },
             {.type = "N", .check = command_line::readable(parse_frames)});
    line.add("--fps", "Frames per second of the video", &choice.video.fps,
             {.check = command_line::Numbers{1, 240}, .shows_default = true});
    line.add("--video-quality", "Of the frames of .avi, 1..100", &choice.video.quality,
             {.check = command_line::Integers{1, 100}, .shows_default = true});
    line.topic = "Options";
}

Status complete_video(VideoChoice &choice, const std::string &model, const RenderOptions &render) {
    std::string &output = choice.video.output;
    if (choice.avi && !output.empty())
        return usage_error("--avi and --turntable both name a video; keep one of them");
    if (choice.avi)
        output = (model.empty() ? "sample" : std::filesystem::path(model).stem().string()) + ".avi";
    if (output.empty())
        return {};
    if (Status known = check_video_name(output); !known)
        return known;
    if (choice.part)
        return usage_error("a turntable has no parts; give --frames their number alone");
    if (render.background[3] == 0 && !has_transparency(output))
        return usage_error(output + ": videos have no transparency; choose pictures (name_%04d.png) or leave out "
                                    "--no-background");
    return {};
}

std::vector<command_line::OutputFile> video_outputs(const VideoOptions &video) {
    std::vector<command_line::OutputFile> outputs;
    for (std::string &name : video_files(video))
        outputs.push_back({"--turntable", std::move(name)});
    return outputs;
}

} // namespace pbm
