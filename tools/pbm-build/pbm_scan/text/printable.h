// Text in messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pbm::build {

// Untrusted text of a file for a message of one line: printable ASCII, at most 40 characters; `printable_in_quotes`
// adds quotes.
std::string printable(std::string_view text);
std::string printable_in_quotes(std::string_view text);

std::string counted(std::uint64_t count, const char *what); // "1 point", "2 points", "2 vertices"

// As printf, at most 255 characters.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char *format, ...);

} // namespace pbm::build
