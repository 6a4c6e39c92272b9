// XXH3 with vectors of 32 bytes. Compiled for processors that have them: include nothing here that defines inline
// functions shared with other files, since the linker keeps only one copy.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstdint>

namespace pbm {

std::uint64_t hash64_avx2(const std::uint8_t *bytes, std::size_t size) { return XXH3_64bits(bytes, size); }

} // namespace pbm
