#include "pbm_scan/text/stand_in.h"

#include "pbm_scan/text/text_lines.h"

#include <array>

namespace pbm::build {

std::optional<std::string> stand_in(std::string_view bytes) {
    if (bytes.starts_with("version https://git-lfs.github.com/spec/"))
        return "a pointer of Git LFS, not the file itself; fetch it with git lfs pull";
    bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
    constexpr std::array<std::string_view, 2> kBeginnings{"<!doctype html", "<html"};
    for (const std::string_view beginning : kBeginnings)
        if (same_word(bytes.substr(0, beginning.size()), beginning))
            return "a page of HTML, not the file itself; download it anew";
    return std::nullopt;
}

} // namespace pbm::build
