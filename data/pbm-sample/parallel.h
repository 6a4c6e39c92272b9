// Runs a loop on several threads. Every index writes only its own slots, so the result cannot depend on the thread
// count.
#pragma once

#include "system/threads/parallel.h"

#include <algorithm>

namespace pbm::sample {

// Calls body(begin, end) for consecutive ranges of at most `grain` indices that cover [0, count). `threads` >= 1.
template <typename Body> void parallel_for(std::size_t count, std::size_t grain, unsigned threads, const Body &body) {
    pbm::parallel_for((count + grain - 1) / grain, static_cast<int>(threads),
                      [&](std::size_t range) { body(range * grain, std::min((range + 1) * grain, count)); });
}

} // namespace pbm::sample
