// Ends long computations from another thread.
#pragma once

#include <atomic>

namespace pbm {

// Thrown by what was cancelled; only who asks for it catches it.
struct Cancelled {};

// While it lives, loops of thread pools (parallel_for and others) that its thread runs throw Cancelled before their
// next item once the flag is set. The same holds for loops within these loops, on whatever thread. Scopes nest.
class CancellationScope {
  public:
    // `flag` must outlive the scope; null: nothing cancels.
    explicit CancellationScope(const std::atomic<bool> *flag);
    ~CancellationScope();
    CancellationScope(const CancellationScope &) = delete;
    CancellationScope &operator=(const CancellationScope &) = delete;

    // Of this thread.
    static const std::atomic<bool> *current();

  private:
    const std::atomic<bool> *outer_;
};

// Throws Cancelled if the flag of this thread's scope is set: for long loops that are no loops of a pool.
void check_cancelled();

} // namespace pbm
