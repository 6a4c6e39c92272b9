#include "command_line/spelling.h"

#include <algorithm>
#include <vector>

namespace pbm::command_line {
namespace {

// Edit distance with swaps of neighbours (optimal string alignment).
std::size_t edits(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j)
        last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U)});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before = last;
        last = row;
    }
    return last[b.size()];
}

} // namespace

std::string nearest_word(std::string_view word, std::span<const std::string> known) {
    constexpr std::size_t kLongestWord = 64; // longer words are not typing errors
    if (word.empty() || word.size() > kLongestWord)
        return {};
    std::size_t fewest = std::max<std::size_t>(1, word.size() / 3) + 1;
    std::string nearest;
    for (const std::string &candidate : known)
        if (const std::size_t count = edits(word, candidate); count < fewest && count < candidate.size()) {
            fewest = count;
            nearest = candidate;
        }
    if (!nearest.empty())
        return nearest;
    const auto begins = [&](const std::string &candidate) { return candidate.starts_with(word); };
    if (std::count_if(known.begin(), known.end(), begins) == 1)
        return *std::find_if(known.begin(), known.end(), begins);
    return {};
}

} // namespace pbm::command_line
