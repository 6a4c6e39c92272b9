#include "report.h"

#include "command_line/json_report.h"
#include "pbm_format/model/las_classes.h"
#include "system/processes/this_process.h"
#include "viewer/options/option_values.h"

#include <nlohmann/json.hpp>

#include <iomanip>
#include <sstream>

namespace pbm {
namespace {

nlohmann::ordered_json look_json(const LookOptions &look) {
    const RenderOptions &render = look.render;
    nlohmann::ordered_json json{
        {"quality", word_of(look.quality)},   {"samples", look.quality == Quality::fine ? look.samples : 1},
        {"texture", render.texture},          {"point_colours", render.point_colours},
        {"shading", word_of(render.shading)}, {"shadows", render.shadows},
        {"panorama", render.panorama},        {"ground", render.ground},
        {"reflections", render.reflections},  {"depth_cue", word_of(look.depth_cue.value_or(DepthCue::none))},
        {"exposure", look.finish.exposure},   {"tone", word_of(look.finish.tone)}};
    if (look.colour_by)
        json["colour_by"] = look.colour_by->field;
    if (look.classes.dropped.any())
        json["drop_class"] = list_of(look.classes.dropped);
    if (look.classes.shown)
        json["show_class"] = list_of(*look.classes.shown);
    return json;
}

// Empty for fast pictures.
std::string quality_text(const LookOptions &look) {
    return look.quality == Quality::fine ? "fine, " + std::to_string(look.samples) + " samples, " : "";
}

std::string video_text(const RenderArguments &arguments, const VideoStatistics &cost) {
    const VideoOptions &video = arguments.video();
    const glm::ivec2 size = arguments.view.resolution, stored = stored_size(video.output, size);
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << command_line::printable(command_line::output_name(video.output))
         << ": " << video.frames << " frames of " << size.x << 'x' << size.y;
    if (stored != size)
        text << " (the edge repeated to " << stored.x << 'x' << stored.y << ", since H.264 has even sizes)";
    text << ", " << quality_text(arguments.frame_look()) << cost.bytes << " bytes, " << cost.ms / 1000 << " s\n";
    return text.str();
}

std::string sequence_text(const RenderArguments &arguments, const SequenceStatistics &cost) {
    const Sequence &sequence = *arguments.sequence;
    const glm::ivec2 size = arguments.view.resolution;
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << command_line::printable(arguments.output) << ": frames "
         << sequence.frames.first << " to " << sequence.frames.last << " of "
         << frame_count(sequence.path, sequence.fps) << ", " << to_string(Value(sequence.fps)) << " a second, camera "
         << command_line::printable(sequence.path.name) << ", " << size.x << 'x' << size.y << ", "
         << quality_text(look_of(Motion::still, arguments.view.look)) << cost.drawn << " drawn, " << cost.kept
         << " kept, " << cost.bytes << " bytes, " << cost.ms / 1000 << " s\n";
    return text.str();
}

// What visitors of a page load.
std::string page_text(const std::string &folder, const WebPageSizes &sizes) {
    const auto kilobytes = [](std::uint64_t bytes) { return std::to_string((bytes + 500) / 1000) + " KB"; };
    const std::string name = command_line::printable(folder);
    std::string text = name + ": a page that loads " + kilobytes(sizes.page + sizes.poster) + " with its poster, " +
                       kilobytes(sizes.viewer) + " of the viewer (gzip), and of the " + kilobytes(sizes.model) +
                       " of the model for the whole view";
    for (std::size_t i = 0; i < kScreens.size(); ++i) {
        const Screen &screen = kScreens[i];
        text += (i == 0 ? " " : ", ") + kilobytes(sizes.viewed[i]) + " on " + screen.name + " (" +
                std::to_string(screen.width) + 'x' + std::to_string(screen.height) + ')';
    }
    text += '\n';
    if (sizes.is_kept)
        text += name + "/index.html: somebody edited it, so it stays as it is; remove it to have it written anew\n";
    return text;
}

} // namespace

std::string to_json(const RenderArguments &arguments, const RunStatistics &s) {
    nlohmann::ordered_json json{{"width", arguments.view.resolution.x},
                                {"height", arguments.view.resolution.y},
                                {"renderer", arguments.view.renderer == Renderer::fast ? "fast" : "reference"},
                                {"look", look_json(look_of(arguments.motion(), s.look))},
                                {"level", s.drawn.level},
                                {"points", s.drawn.points},
                                {"drawn_points", s.drawn.drawn_points},
                                {"file_bytes", s.file_bytes},
                                {"bytes_read", s.cost.bytes_read},
                                {"points_decoded", s.cost.points_decoded},
                                {"load_ms", s.load_ms},
                                {"frame_ms", s.frame_ms},
                                {"encode_ms", s.encode_ms}};
    if (s.bench) {
        json["bench_frames"] = arguments.bench;
        json["bench_min_ms"] = s.bench->min_ms;
        json["bench_median_ms"] = s.bench->median_ms;
        json["bench_drawn_points"] = s.bench->drawn_points;
    }
    if (s.video) {
        json["video_frames"] = arguments.video().frames;
        json["video_fps"] = arguments.video().fps;
        json["video_bytes"] = s.video->bytes;
        json["video_ms"] = s.video->ms;
    }
    if (s.sequence)
        json["sequence"] = {{"camera", arguments.sequence->path.name},
                            {"fps", arguments.sequence->fps},
                            {"first_frame", arguments.sequence->frames.first},
                            {"last_frame", arguments.sequence->frames.last},
                            {"drawn", s.sequence->drawn},
                            {"kept", s.sequence->kept},
                            {"bytes", s.sequence->bytes},
                            {"ms", s.sequence->ms}};
    if (s.page)
        json["page"] = {{"page_bytes", s.page->page},
                        {"poster_bytes", s.page->poster},
                        {"viewer_gzip_bytes", s.page->viewer},
                        {"threaded_viewer_gzip_bytes", s.page->threaded_viewer},
                        {"model_bytes", s.page->model},
                        {"phone_model_bytes", s.page->viewed[0]},
                        {"laptop_model_bytes", s.page->viewed[1]},
                        {"4k_model_bytes", s.page->viewed[2]},
                        {"page_kept", s.page->is_kept}};
    json["peak_memory"] = peak_memory();
    return json.dump(2) + "\n";
}

std::string report(const RenderArguments &arguments, const Camera &camera, const RunStatistics &s) {
    const glm::ivec2 size = arguments.view.resolution;
    const auto shown_name = [](const std::string &name) {
        return command_line::printable(command_line::output_name(name));
    };
    std::ostringstream text;
    const bool is_verbose = arguments.view.verbosity == command_line::Verbosity::verbose;
    if (is_verbose && !arguments.sequence) // whose frames had a line each
        text << "view: " << view_as_options(camera, arguments.view, size) << look_as_options(s.look) << '\n'
             << "read: " << s.cost.bytes_read << " of " << s.file_bytes << " bytes, " << s.cost.points_decoded
             << " points decoded\n";
    text << std::fixed << std::setprecision(1);
    if (arguments.wants_picture())
        text << shown_name(arguments.output.empty() ? arguments.input : arguments.output) << ": " << size.x << 'x'
             << size.y << ", " << quality_text(arguments.picture_look()) << "level " << s.drawn.level << ", "
             << s.drawn.drawn_points << " of " << s.drawn.points << " points drawn, load " << s.load_ms << " ms, frame "
             << s.frame_ms << " ms";
    if (arguments.wants_picture() && s.is_encoded_while_drawn)
        text << " with encoding\n";
    else if (arguments.wants_picture())
        text << ", encode " << s.encode_ms << " ms\n";
    if (s.video)
        text << video_text(arguments, *s.video);
    if (s.sequence)
        text << sequence_text(arguments, *s.sequence);
    if (s.page)
        text << page_text(arguments.page, *s.page);
    if (s.bench)
        text << "bench: " << arguments.bench << " frames, minimum " << std::setprecision(2) << s.bench->min_ms
             << " ms, median " << s.bench->median_ms << " ms, " << s.bench->drawn_points << " points drawn, memory "
             << std::setprecision(1) << static_cast<double>(peak_memory()) / (1 << 20) << " MiB\n";
    return text.str();
}

} // namespace pbm
