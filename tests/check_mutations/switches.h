// The switches of instrumented sources: which of their checks is removed, or which of their values is another one.
#pragma once

#include <cstdlib>

namespace pbm {

// From the environment, PBM_SWITCH; 0: none. Constants of other files ask before main starts.
inline int switched() {
    static const int number = [] {
        const char *text = std::getenv("PBM_SWITCH");
        return text == nullptr ? 0 : std::atoi(text);
    }();
    return number;
}

inline bool check_kept(int number) { return number != switched(); }
inline bool is_mutated(int number) { return number == switched(); }

} // namespace pbm
