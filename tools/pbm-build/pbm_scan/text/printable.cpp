#include "pbm_scan/text/printable.h"

namespace pbm::build {

std::string printable(std::string_view text) {
    constexpr std::size_t kMost = 40;
    std::string out;
    for (const char c : text.substr(0, kMost))
        out += c >= ' ' && c <= '~' ? c : '?';
    return out + (text.size() > kMost ? "..." : "");
}

std::string quoted(std::string_view text) { return std::string(1, '\'').append(printable(text)).append(1, '\''); }

} // namespace pbm::build
