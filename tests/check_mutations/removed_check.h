// The switch of instrumented sources: which of their checks is removed.
#pragma once

namespace pbm {

extern const int removed_check; // from the environment, PBM_REMOVED_CHECK; 0: none

inline bool check_kept(int number) { return number != removed_check; }

} // namespace pbm
