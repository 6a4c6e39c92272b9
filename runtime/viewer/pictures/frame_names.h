// Names of a video's frames: name_%04d.png and the number of the frame.
#pragma once

#include "system/error.h"

#include <string>

namespace pbm {

struct FrameNames {
    std::string before, after; // the number
    std::size_t digits = 0;    // at least so many, zeros in front

    std::string of(int frame) const;
};

// "%d" or "%0Nd", N 1..9, once, and no other %.
//
// errors  usage
Result<FrameNames> parse_frame_names(const std::string &pattern);

} // namespace pbm
