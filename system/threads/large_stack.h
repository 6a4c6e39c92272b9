// A stack that does not depend on the shell's limit.
#pragma once

#include <functional>

namespace pbm {

// Runs `program` with a stack of at least 8 MB, and threads that it starts too. A shell may have set a limit (ulimit
// -s) that is too small for the tables of a frame and for libraries; then the program runs in a thread of its own.
// Returns what `program` returns, which throws nothing.
int run_with_large_stack(const std::function<int()> &program);

} // namespace pbm
