#include "viewer/pictures/frame_names.h"

namespace pbm {

std::string FrameNames::of(int frame) const {
    std::string number = std::to_string(frame);
    if (number.size() < digits)
        number.insert(0, digits - number.size(), '0');
    return before + number + after;
}

bool names_frames(const std::string &path) { return path.find('%', path.rfind('/') + 1) != std::string::npos; }

Result<FrameNames> parse_frame_names(const std::string &pattern) {
    const std::size_t name = pattern.rfind('/') + 1; // 0 without a folder
    FrameNames names;
    names.before = pattern.substr(0, name);
    bool has_number = false;
    for (std::size_t at = name; at < pattern.size(); ++at) {
        std::string &text = has_number ? names.after : names.before;
        if (pattern[at] != '%') {
            text += pattern[at];
            continue;
        }
        if (pattern.compare(at, 2, "%%") == 0) {
            text += '%';
            ++at;
            continue;
        }
        ++at;
        std::size_t digits = 0;
        if (at + 1 < pattern.size() && pattern[at] == '0' && pattern[at + 1] >= '1' && pattern[at + 1] <= '9') {
            digits = static_cast<std::size_t>(pattern[at + 1] - '0');
            at += 2;
        }
        if (has_number || at >= pattern.size() || pattern[at] != 'd')
            return usage_error(pattern +
                               ": a % stands for the number of the frame, once, as %d or %04d; %% is a % of the name");
        names.digits = digits;
        has_number = true;
    }
    if (has_number)
        return names;
    return usage_error(pattern + ": the number of the frame is missing; choose a name like name_%04d.png");
}

} // namespace pbm
