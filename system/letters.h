// Letters without case.
#pragma once

namespace pbm {

// Of ASCII; other bytes are left alone.
constexpr char lower_case(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

} // namespace pbm
