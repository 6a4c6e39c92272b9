// Which word somebody meant.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace pbm::command_line {

// The word of `known` that `word` is a slip of: the fewest letters added, left out, exchanged or swapped with their
// neighbour, at most a third of it; or the only one that begins with it. Empty if there is none.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

} // namespace pbm::command_line
