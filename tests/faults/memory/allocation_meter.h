// Counts heap allocations of the program and makes chosen ones fail. malloc_meter.cpp replaces malloc, which includes
// zstd's allocations. new_meter.cpp replaces only operator new, for builds whose sanitizer already replaces malloc.
#pragma once

#include <cstdint>

namespace pbm::faults {

struct HeapUse {
    std::uint64_t live = 0, peak = 0; // bytes; peak since the last reset_peak()
    std::uint64_t calls = 0;          // allocations so far
};
HeapUse heap_use();
void reset_peak(); // sets peak = live
// Whether freed memory is reused at once: a sanitizer delays that.
bool reuses_memory();

// Makes the n-th allocation from now on fail (1: the next one), on any thread, and with `all_further` all later ones.
// 0: no further failures.
void fail_allocation(std::uint64_t n, bool all_further = false);
// Whether the chosen allocation was reached and failed.
bool allocation_failed();

} // namespace pbm::faults
