// File names of a video's frames: a pattern like name_%04d.png with the frame's number.
#pragma once

#include "system/error.h"

#include <string>

namespace pbm {

struct FrameNames {
    std::string before, after; // text before and after the number
    std::size_t digits = 0;    // minimum, padded with zeros

    std::string of(int frame) const;
};

// Accepts "%d" or "%0Nd", N 1..9, once, and no other %.
//
// errors  usage
Result<FrameNames> parse_frame_names(const std::string &pattern);

} // namespace pbm
