#include "pbm_build/hit_store.h"

#include <algorithm>
#include <utility>

namespace pbm::build {
namespace {

constexpr int kMostBucketLevel = 5; // a surface touches a few thousand of the 32,768 nodes
static_assert(3 * (kMaxDepth - kMostBucketLevel) + kSourceBits <= 64);
constexpr std::size_t kFirstChunk = 64, kLargestChunk = 2048;

} // namespace

HitStore::HitStore(int depth, int writers, std::uint64_t max_bytes)
    : bucket_level_(std::clamp(depth - kBlockBits / 3, 1, kMostBucketLevel)), local_bits_(3 * (depth - bucket_level_)),
      local_mask_((MortonCode{1} << local_bits_) - 1), max_bytes_(max_bytes),
      writers_(static_cast<std::size_t>(writers)) {
    for (Writer &writer : writers_)
        writer.resize(bucket_count());
}

void HitStore::grow(List &list) {
    const std::size_t capacity =
        list.chunks.empty() ? kFirstChunk : std::min(2 * list.chunks.back().capacity, kLargestChunk);
    list.chunks.push_back({std::unique_ptr<Hit[]>(new Hit[capacity]), capacity});
    list.next = list.chunks.back().hits.get();
    list.room = capacity;
    bytes_.fetch_add(capacity * sizeof(Hit), std::memory_order_relaxed);
}

void HitStore::add(int writer, std::span<const MortonCode> codes, std::uint32_t source) {
    MortonCode differ = 0;
    for (const MortonCode code : codes)
        differ |= code ^ codes.front();
    List &list = writers_[static_cast<std::size_t>(writer)][codes.front() >> local_bits_];
    if (differ > local_mask_ || list.room < codes.size()) {
        for (const MortonCode code : codes)
            add(writer, code, source);
        return;
    }
    Hit *const next = std::exchange(list.next, list.next + codes.size());
    list.room -= codes.size();
    for (std::size_t i = 0; i < codes.size(); ++i)
        next[i] = (codes[i] & local_mask_) << kSourceBits | source;
}

std::uint64_t HitStore::size() const {
    std::uint64_t hits = 0;
    for (const Writer &writer : writers_)
        for (const List &list : writer) {
            for (const Chunk &chunk : list.chunks)
                hits += chunk.capacity;
            hits -= list.room;
        }
    return hits;
}

void HitStore::take(std::size_t bucket, std::vector<Hit> &out) {
    std::size_t most = out.size();
    for (const Writer &writer : writers_)
        for (const Chunk &chunk : writer[bucket].chunks)
            most += chunk.capacity;
    out.reserve(most);
    for (Writer &writer : writers_) {
        List &list = writer[bucket];
        for (std::size_t i = 0; i < list.chunks.size(); ++i) {
            const Chunk &chunk = list.chunks[i];
            const std::size_t used = chunk.capacity - (i + 1 == list.chunks.size() ? list.room : 0);
            out.insert(out.end(), chunk.hits.get(), chunk.hits.get() + used);
        }
        list = List();
    }
}

} // namespace pbm::build
