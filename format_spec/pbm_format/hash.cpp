#include "pbm_format/hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace pbm {

struct StreamingHash::State {
    XXH3_state_t xxh3;
};

#ifdef __x86_64__
std::uint64_t hash64_avx2(const std::uint8_t *bytes, std::size_t size);
std::uint64_t hash64_avx512(const std::uint8_t *bytes, std::size_t size);
#endif

namespace {

using Hash64 = std::uint64_t (*)(const std::uint8_t *bytes, std::size_t size);

// The one with the widest vectors that the processor has.
Hash64 widest_hash64() {
#ifdef __x86_64__
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") != 0)
        return hash64_avx512;
    if (__builtin_cpu_supports("avx2") != 0)
        return hash64_avx2;
#endif
    return [](const std::uint8_t *bytes, std::size_t size) -> std::uint64_t { return XXH3_64bits(bytes, size); };
}

} // namespace

std::uint64_t hash64(ByteView bytes) {
    static const Hash64 widest = widest_hash64();
    return widest(bytes.data(), bytes.size());
}

StreamingHash::StreamingHash() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->xxh3); }
StreamingHash::~StreamingHash() = default;

void StreamingHash::add(ByteView bytes) { XXH3_128bits_update(&state_->xxh3, bytes.data(), bytes.size()); }

Hash128 StreamingHash::finish() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_->xxh3);
    return {hash.low64, hash.high64};
}

} // namespace pbm
