// pbm-view: a binary voxel grid in a window.
#include "options.h"
#include "viewer.h"
#include "window/window.h"

#include "command_line/command_line.h"

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>

namespace {

using namespace pbm;

constexpr std::string_view kProgram = "pbm-view";

// Finds the sample that was built and installed with this program, by its path relative to the program.
Result<std::string> sample_model() {
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    const fs::path sample = (program.parent_path() / PBM_SAMPLE_FROM_PROGRAM).lexically_normal();
    if (fs::is_regular_file(sample, ignored))
        return sample.string();
    return Error{ErrorCode::io, 0,
                 "no FILE is named and the sample " + sample.string() +
                     " is not there; make one: pbm-sample -o sample.ply && pbm-build sample.ply -o sample.pbvg"};
}

int run(int argc, char **argv, std::unique_ptr<ThreadPool> &background) {
    const auto start = Viewer::Clock::now();
    Arguments arguments;
    if (const auto done = parse(kProgram, argc, argv, arguments))
        return *done;
    if (const Status affordable = check_picture_memory(arguments.view); !affordable)
        return command_line::fail(kProgram, "", affordable.error());
    std::string path = arguments.input;
    if (path.empty()) {
        auto sample = sample_model();
        if (!sample)
            return command_line::fail(kProgram, "", sample.error());
        path = std::move(*sample);
    }
    // Refuse what is no model before a window opens.
    if (const Status good = check_scene(path); !good)
        return command_line::fail(kProgram, path, with_advice(kProgram, good.error()));

    std::optional<VideoSink> video;
    if (const VideoOptions &wanted = arguments.choice.video; !wanted.output.empty()) {
        if (const auto refused = command_line::refuse_outputs(kProgram, {{path}}, video_files(wanted)))
            return *refused;
        auto opened = open_video(wanted, arguments.view.resolution);
        if (!opened)
            return command_line::fail(kProgram, wanted.output, opened.error());
        video = std::move(*opened);
    }

    background = std::make_unique<ThreadPool>(2);
    Loading loading = begin_loading(*background, path, arguments.view);
    const auto window = Window::open(std::filesystem::path(path).filename().string() + " - " + std::string(kProgram),
                                     arguments.view.resolution);
    if (!window)
        return command_line::fail(kProgram, "", window.error());
    Viewer viewer(arguments, **window, *background, {kProgram, start, path, std::move(loading), std::move(video)});
    return viewer.run();
}

} // namespace

int main(int argc, char **argv) {
    std::unique_ptr<ThreadPool> background;
    const int code = command_line::run_program(kProgram, [&] { return run(argc, argv, background); });
    // Quit without waiting for a model that is loaded or drawn: all output has been written.
    if (background && background->busy())
        std::quick_exit(code);
    return code;
}
