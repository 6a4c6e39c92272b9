// In place of the switch that tests use: every check is removed, at compile time.
#pragma once

namespace pbm {

constexpr bool check_kept(int) { return false; }

} // namespace pbm
