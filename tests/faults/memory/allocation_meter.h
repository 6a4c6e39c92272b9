// Counts what this program takes from the heap, and lets it fail: zstd's malloc as well as our operator new. One of two
// files implements it: malloc_meter.cpp takes the C library's place, new_meter.cpp, for builds whose sanitizer has
// taken it already, only that of operator new.
#pragma once

#include <cstdint>

namespace pbm::faults {

struct HeapUse {
    std::uint64_t live = 0, peak = 0; // bytes; peak since the last reset_peak()
    std::uint64_t calls = 0;          // allocations so far
};
HeapUse heap_use();
void reset_peak(); // to what is live
// Whether memory that is given back can be used again: a sanitizer keeps it for a while.
bool reuses_memory();

// The n-th allocation from now on fails (1 is the next one), on whatever thread, and if `all_further` every one after
// it; 0: none any more.
void fail_allocation(std::uint64_t n, bool all_further = false);
// Whether it came to that.
bool allocation_failed();

} // namespace pbm::faults
