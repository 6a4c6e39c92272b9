// XXH3 with vectors of 64 bytes. Compiled for processors that have them: nothing may be included here of which the
// linker keeps one copy for all files.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstdint>

namespace pbm {

std::uint64_t hash64_avx512(const std::uint8_t *bytes, std::size_t size) { return XXH3_64bits(bytes, size); }

} // namespace pbm
