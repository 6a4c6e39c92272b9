#include "viewer/pbm-view/window/desktop.h"

#include "system/files/file_names.h"
#include "system/files/file_replacement.h"
#include "system/processes/child_program.h"

#include <filesystem>
#include <string_view>

namespace pbm {

bool desktop_prefers_light() {
    bool light = false;
    // The answer is "(<<uint32 2>>,)": 0 nothing, 1 dark, 2 light.
    const auto ended =
        run_program({"gdbus", "call", "--session", "--timeout=2", "--dest=org.freedesktop.portal.Desktop",
                     "--object-path=/org/freedesktop/portal/desktop", "--method=org.freedesktop.portal.Settings.Read",
                     "org.freedesktop.appearance", "color-scheme"},
                    [&](std::string_view line) { light |= line.find("uint32 2") != std::string_view::npos; });
    return ended && ended->exit_code == 0 && light;
}

bool is_first_start() {
    namespace fs = std::filesystem;
    const std::string folder = xdg_folder("XDG_STATE_HOME", ".local/state", "pbm");
    const fs::path mark = fs::path(folder) / "started";
    std::error_code error;
    if (folder.empty() || fs::exists(mark, error))
        return false;
    fs::create_directories(folder, error);
    return replace_file(mark.string(), {}, Durability::cached).ok();
}

} // namespace pbm
