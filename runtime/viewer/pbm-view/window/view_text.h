// Texts of the window and of -v.
#pragma once

#include "viewer/pbm-view/window/overlay.h"

#include "viewer/navigation/camera_control.h"
#include "viewer/scene/shown_model.h"

#include <string>
#include <vector>

namespace pbm {

// 1234567 as "1,234,567".
std::string grouped(std::uint64_t number);
std::string file_name(const std::string &path);
// "12.3 ms".
std::string milliseconds(double seconds);
std::vector<OverlayRow> help_rows(CameraMode mode);
// Cost of a picture of `size`, for the window's corner; `depth` is the model's.
std::string cost_text(const PictureStatistics &picture, int depth, glm::ivec2 size);
// The same, and what was loaded so far, for -v.
std::string cost_line(const PictureStatistics &picture, int depth, glm::ivec2 size, const StreamingStatistics &loaded);

} // namespace pbm
