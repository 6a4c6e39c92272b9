// Views that the metadata of a model has (BVG.md 3.6): the one that a window starts with, and the cameras of the scan.
#pragma once

#include "system/error.h"
#include "viewer/options/view_options.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

// A camera and its angle of view as the command line has it, degrees: so that it prints as it was written.
struct SavedView {
    Camera camera;
    double view_angle = 30;
};

struct NamedView {
    std::string name; // as the file has it
    SavedView view;   // usable
};

// The view to start with.
std::optional<SavedView> start_view(std::string_view metadata);
// The cameras of the scan, in their order. What is not understood, sees nothing or has no name is left out.
std::vector<NamedView> named_views(std::string_view metadata);
// The first camera of the scan that has this name.
//
// errors  usage  there is none; the message lists those that there are
Result<SavedView> find_view(std::string_view metadata, const std::string &name);
// The options with the camera of a view.
ViewOptions with_camera(ViewOptions options, const SavedView &view);

// The metadata with this view to start with, in place of another one.
//
// errors  too_large  longer than 4,096 bytes
Result<std::string> with_start_view(std::string_view metadata, const SavedView &view);

} // namespace pbm
