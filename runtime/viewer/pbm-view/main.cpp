// pbm-view: a binary voxel grid in a window.
#include "options.h"
#include "viewer.h"

#include "command_line/command_line.h"
#include "system/processes/this_process.h"

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>

namespace {

using namespace pbm;

constexpr std::string_view kProgram = "pbm-view";

// The sample that was built and installed with this program, by its path relative to the program; empty if it is not
// there.
std::string sample_model() {
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    const fs::path sample = (program.parent_path() / PBM_SAMPLE_FROM_PROGRAM).lexically_normal();
    return fs::is_regular_file(sample, ignored) ? sample.string() : "";
}

// The files to show, and what is wrong with the first one. Standard error is told at once, before there is a window.
Viewer::Start examine(const Arguments &arguments, FrameLog::Clock::time_point time) {
    Viewer::Start start{.program = kProgram, .time = time};
    const auto refuse = [&](const std::string &path, const Error &error) {
        command_line::fail(kProgram, path, error);
        start.problem = error;
    };
    std::vector<std::string> paths = arguments.inputs;
    start.is_sample = paths.empty();
    if (paths.empty())
        paths = {sample_model()};
    if (paths.front().empty())
        return start;
    auto files = FileList::of(paths);
    if (!files) {
        refuse("", files.error());
        return start;
    }
    start.files = std::move(*files);
    const std::string &path = start.files.current();
    if (const Status good = is_scan(path) ? Status() : check_scene(path); !good)
        refuse(path, with_advice(kProgram, good.error()));
    return start;
}

int run(int argc, char **argv, std::unique_ptr<Viewer::Workers> &workers) {
    const auto time = FrameLog::Clock::now();
    Arguments arguments;
    if (const auto done = parse(kProgram, argc, argv, arguments))
        return *done;
    if (const Status affordable = check_picture_memory(arguments.view); !affordable)
        return command_line::fail(kProgram, "", affordable.error());
    Viewer::Start start = examine(arguments, time);
    const std::string path = start.files.empty() ? "" : start.files.current();

    if (const VideoOptions &wanted = arguments.choice.video; !wanted.output.empty()) {
        if (start.problem)
            return exit_code(start.problem->code);
        if (path.empty())
            return command_line::fail_usage(kProgram, "there is no sample to record; name a FILE");
        if (const auto refused = command_line::refuse_outputs(kProgram, {{path}}, video_outputs(wanted)))
            return *refused;
        auto opened = open_video(wanted, arguments.view.resolution);
        if (!opened)
            return command_line::fail(kProgram, command_line::output_name(wanted.output), opened.error());
        start.video = std::move(*opened);
    } else {
        read_zeros_when_mapped_file_shrinks(); // the window keeps its last picture
    }

    workers = std::make_unique<Viewer::Workers>();
    if (!path.empty() && !start.problem)
        start.opening = std::make_unique<Opening>(workers->helpers, path, arguments.view, arguments.scans,
                                                  !arguments.show_panel && !start.video);
    const std::string title = path.empty() ? "" : std::filesystem::path(path).filename().string() + " - ";
    const auto window = Window::open(title + std::string(kProgram), arguments.view.resolution, arguments.scales_window);
    if (!window) // the file's own problem was told
        return start.problem ? exit_code(start.problem->code) : command_line::fail(kProgram, "", window.error());
    Viewer viewer(arguments, **window, *workers, std::move(start));
    return viewer.run();
}

} // namespace

int main(int argc, char **argv) {
    std::unique_ptr<Viewer::Workers> workers;
    const int code = command_line::run_program(kProgram, [&] { return run(argc, argv, workers); });
    // Quit without waiting for a model that is loaded or drawn: all output has been written.
    if (workers && workers->busy())
        std::quick_exit(code);
    return code;
}
