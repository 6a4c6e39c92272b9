#include "viewer/pictures/frame_names.h"

namespace pbm {

std::string FrameNames::of(int frame) const {
    std::string number = std::to_string(frame);
    if (number.size() < digits)
        number.insert(0, digits - number.size(), '0');
    return before + number + after;
}

Result<FrameNames> parse_frame_names(const std::string &pattern) {
    const std::size_t at = pattern.find('%');
    FrameNames names;
    if (at != std::string::npos) {
        std::size_t end = at + 1;
        if (end + 1 < pattern.size() && pattern[end] == '0' && pattern[end + 1] >= '1' && pattern[end + 1] <= '9') {
            names.digits = static_cast<std::size_t>(pattern[end + 1] - '0');
            end += 2;
        }
        names.before = pattern.substr(0, at);
        if (end < pattern.size() && pattern[end] == 'd') {
            names.after = pattern.substr(end + 1);
            if (names.after.find('%') == std::string::npos)
                return names;
        }
    }
    return Error{ErrorCode::usage, 0,
                 pattern + ": the number of the frame is missing; choose a name like name_%04d.png"};
}

} // namespace pbm
