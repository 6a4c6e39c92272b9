#include "campaign.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

namespace pbm::faults {

bool Tally::require(bool law, const std::string &what) {
    constexpr std::uint64_t kMaxShown = 20;
    if (!law && ++broken_ <= kMaxShown) {
        std::printf("BROKEN: %s\n", what.c_str());
        std::fflush(stdout);
    }
    return law;
}

void Tally::note_largest(const std::string &what, double value) {
    double &largest = largest_[what];
    largest = std::max(largest, value);
}

std::string Tally::row(const std::string &name, double seconds) const {
    std::ostringstream text;
    text << "| " << name << " | " << cases_ << " | " << detected_ << " | " << broken_ << " | ";
    for (const auto &[what, sum] : sums_)
        text << sum << ' ' << what << "; ";
    text.precision(3);
    for (const auto &[what, value] : largest_)
        text << what << " at most " << value << "; ";
    text << seconds << " s |";
    return text.str();
}

} // namespace pbm::faults
