// Text in messages.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace pbm::build {

// Untrusted text of a file for a message of one line: at most 40 characters of UTF-8, with "?" for invalid bytes and
// control characters. `printable_in_quotes` adds quotes.
std::string printable(std::string_view text);
std::string printable_in_quotes(std::string_view text);

// Joins untrusted names to a list. Five or more names with ascending numbers become one entry, "q0..q39". The names
// beyond 64 entries become "7 more".
std::string listed(std::span<const std::string> names, std::string_view separator = ", ");

// "a", "a and b", "a, b and c".
std::string enumerated(std::span<const std::string> names);

std::string counted(std::uint64_t count, const char *what); // "1 point", "2 points", "2 vertices"

// As printf, at most 255 characters.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char *format, ...);

} // namespace pbm::build
