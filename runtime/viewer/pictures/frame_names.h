// File names of a video's frames: a pattern like name_%04d.png with the frame's number.
#pragma once

#include "system/error.h"

#include <string>

namespace pbm {

// Frames `first` to `last`, from 1.
struct FrameRange {
    int first, last;
    bool operator==(const FrameRange &) const = default;
};

struct FrameNames {
    std::string before, after; // text before and after the number
    std::size_t digits = 0;    // minimum, padded with zeros

    std::string of(int frame) const;
};

// In the last component of the path: "%d" or "%0Nd", N 1..9, is the number, once, and "%%" is a %. Folders stay as they
// are.
//
// errors  usage
Result<FrameNames> parse_frame_names(const std::string &pattern);

// Whether the last component of the path has a %.
bool names_frames(const std::string &path);

} // namespace pbm
