// Finds the word that a misspelt word stands for.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace pbm::command_line {

// The word of `known` with the fewest edits from `word` (insertions, deletions, substitutions, swaps of neighbours), at
// most a third of its letters; or the only word that begins with `word`. Empty if there is none.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

} // namespace pbm::command_line
