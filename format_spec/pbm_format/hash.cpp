#include "pbm_format/hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace pbm {

struct StreamingHash::State {
    XXH3_state_t xxh3;
};

std::uint64_t hash64(ByteView bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

StreamingHash::StreamingHash() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->xxh3); }
StreamingHash::~StreamingHash() = default;

void StreamingHash::add(ByteView bytes) { XXH3_128bits_update(&state_->xxh3, bytes.data(), bytes.size()); }

Hash128 StreamingHash::finish() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_->xxh3);
    return {hash.low64, hash.high64};
}

} // namespace pbm
