#include "viewer/opening/file_dialog.h"

#include "command_line/scan_extensions.h"
#include "system/processes/child_program.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

namespace pbm {
namespace {

constexpr std::string_view kTitle = "Open models or scans";

// "*.ply *.PLY ...": these programs tell cases apart.
std::string patterns_of_names() {
    std::string patterns = "*.pbvg *.bvg";
    for (const std::string_view extension : command_line::kScanExtensions) {
        std::string capitals(extension);
        for (char &c : capitals)
            c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
        for (const char *packed : {"", ".gz", ".zst"})
            patterns.append(" *").append(extension).append(packed);
        patterns.append(" *").append(capitals);
    }
    return patterns;
}

// A command that prints one path a line.
std::vector<std::string> command(const std::string &program, const std::string &folder) {
    const std::string title(kTitle), patterns = patterns_of_names();
    if (program == "kdialog")
        return {program,
                "--title",
                title,
                "--multiple",
                "--separate-output",
                "--getopenfilename",
                folder,
                patterns + "|Models and scans\n*|All files"};
    return {program,
            "--file-selection",
            "--multiple",
            "--separator=\n",
            "--title=" + title,
            "--filename=" + folder + "/",
            "--file-filter=Models and scans | " + patterns,
            "--file-filter=All files | *"};
}

} // namespace

Result<std::vector<std::string>> ask_for_files(const std::string &folder, const std::stop_token &stop) {
    std::array<std::string, 2> programs{"zenity", "kdialog"};
    const char *const desktop = std::getenv("XDG_CURRENT_DESKTOP");
    if (desktop != nullptr && std::string_view(desktop).find("KDE") != std::string_view::npos)
        std::swap(programs[0], programs[1]);
    for (const std::string &program : programs) {
        std::vector<std::string> files;
        const auto ended = run_program(
            command(program, folder),
            [&](std::string_view line) {
                if (!line.empty())
                    files.emplace_back(line);
            },
            stop);
        if (!ended)
            continue;
        if (ended->exit_code == 0)
            return files;
        if (ended->exit_code == 1 || stop.stop_requested()) // closed, or Cancel
            return std::vector<std::string>{};
        return Error{ErrorCode::memory, 0, program + " failed" + (ended->message.empty() ? "" : ": " + ended->message)};
    }
    return Error{ErrorCode::memory, 0,
                 "no open dialog is installed (zenity or kdialog); drop a file onto the window instead"};
}

} // namespace pbm
