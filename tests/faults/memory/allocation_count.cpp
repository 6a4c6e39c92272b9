#include "allocation_count.h"

namespace pbm::faults {

HeapUse heap_use() { return count.use(); }
void reset_peak() { count.reset_peak(); }
void fail_allocation(std::uint64_t n, bool all_further) { count.fail(n, all_further); }
bool allocation_failed() { return count.failed(); }

} // namespace pbm::faults
