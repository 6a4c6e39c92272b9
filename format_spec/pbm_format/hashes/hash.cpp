#include "pbm_format/hashes/hash.h"

#include "pbm_format/hashes/hash_ways.h"
#include "system/error.h"

#include <algorithm>

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

std::uint64_t hash64_plain(const std::uint8_t *bytes, std::size_t size) { return XXH3_64bits(bytes, size); }

} // namespace

std::span<const HashWay> hash_ways() {
#ifdef __x86_64__
    __builtin_cpu_init();
#endif
    static const std::array ways = std::to_array<HashWay>({
#ifdef __x86_64__
        {"AVX-512", hash64_avx512, __builtin_cpu_supports("avx512f") != 0},
        {"AVX2", hash64_avx2, __builtin_cpu_supports("avx2") != 0},
#endif
        {"plain", hash64_plain, true},
    });
    return ways;
}

std::uint64_t hash64(ByteView bytes) {
    static const auto widest =
        std::find_if(hash_ways().begin(), hash_ways().end(), [](const HashWay &way) { return way.supported; })->hash;
    return widest(bytes.data(), bytes.size());
}

std::string hexadecimal(const Hash128 &hash) {
    const auto digits = [](std::uint64_t half) { return to_string(hash_value(half)).substr(2); }; // without 0x
    return digits(hash[1]) + digits(hash[0]);
}

StreamingHash::StreamingHash() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->xxh3); }
StreamingHash::~StreamingHash() = default;

void StreamingHash::add(ByteView bytes) { XXH3_128bits_update(&state_->xxh3, bytes.data(), bytes.size()); }

Hash128 StreamingHash::finish() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_->xxh3);
    return {hash.low64, hash.high64};
}

} // namespace pbm
