// Untrusted text in messages.
#pragma once

#include <string>
#include <string_view>

namespace pbm::build {

// Text of the file for a message of one line: printable ASCII, at most 40 characters; `quoted` adds quotes.
std::string printable(std::string_view text);
std::string quoted(std::string_view text);

} // namespace pbm::build
