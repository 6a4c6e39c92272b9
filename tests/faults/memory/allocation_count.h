// Shared by both implementations of allocation_meter.h: counters, which must not allocate.
#pragma once

#include "allocation_meter.h"

#include <atomic>

namespace pbm::faults {

class AllocationCount {
  public:
    // Whether the next allocation may succeed.
    bool allow() {
        ++calls_;
        if (countdown_.load(std::memory_order_relaxed) == 0)
            return true;
        const std::uint64_t before = countdown_.fetch_sub(1);
        if (before > 1)
            return true;
        failed_ = true;
        if (all_further_)
            countdown_ = 1;
        else
            countdown_ = 0;
        return false;
    }
    void took(std::uint64_t bytes) {
        const std::uint64_t live = live_ += bytes;
        std::uint64_t peak = peak_;
        while (live > peak && !peak_.compare_exchange_weak(peak, live)) {
        }
    }
    void gave(std::uint64_t bytes) { live_ -= bytes; }

    HeapUse use() const { return {live_, peak_, calls_}; }
    void reset_peak() { peak_ = live_.load(); }
    void fail(std::uint64_t n, bool all_further) {
        if (n > 0)
            failed_ = false;
        all_further_ = all_further;
        countdown_ = n;
    }
    bool failed() const { return failed_; }

  private:
    std::atomic<std::uint64_t> live_{0}, peak_{0}, calls_{0}, countdown_{0};
    std::atomic<bool> failed_{false}, all_further_{false};
};

inline constinit AllocationCount count;

} // namespace pbm::faults
