// The command line of pbm-view.
#pragma once

#include "viewer/pbm-view/window/theme.h"

#include "viewer/navigation/camera_control.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/options/video_options.h"
#include "viewer/options/view_options.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

struct Arguments {
    std::vector<std::string> inputs; // models, scans and folders; empty: the sample
    ViewOptions view;
    ScanOptions scans;
    VideoChoice choice;
    CameraMode camera_mode = CameraMode::orbit;
    double min_fps = 30; // frames per second while the view moves; 0: any
    bool show_frame_time = false;
    bool show_panel = false;
    Theme theme = Theme::desktop;
    bool scales_window = true; // with the desktop: no --resolution was given
};

// Fills `arguments`, or returns the exit code if the program is done.
std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments);

} // namespace pbm
