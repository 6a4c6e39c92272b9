#include "pbm_build/voxels/hit_store.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace pbm::build {
namespace {

constexpr int kMaxBucketLevel = 5; // a surface touches a few thousand of the 32,768 nodes
static_assert(3 * (kMaxDepth - kMaxBucketLevel) + kSourceBits <= 64);
constexpr std::size_t kFirstChunk = 128, kLargestChunk = 8192; // words
constexpr std::uint64_t kCountedAtOnce = 1 << 12;
constexpr std::size_t kSlab = std::size_t{1} << 15; // words, 64 KiB

} // namespace

int HitStore::bucket_level(int depth) { return std::clamp(depth - kBlockBits / 3, 1, kMaxBucketLevel); }

HitStore::HitStore(int depth, int writers, std::uint64_t max_hits)
    : bucket_level_(bucket_level(depth)), local_bits_(3 * (depth - bucket_level_)),
      local_mask_((MortonCode{1} << local_bits_) - 1),
      block_mask_((MortonCode{1} << std::min(local_bits_, kBlockBits)) - 1), max_hits_(max_hits),
      writers_(static_cast<std::size_t>(writers)) {
    for (Writer &writer : writers_)
        writer.lists.resize(bucket_count());
}

// Ends the last record: writes the number of its hits, and returns it.
std::uint64_t HitStore::finish(List &list) {
    if (list.head == nullptr)
        return 0;
    const auto hits = static_cast<std::uint64_t>(list.next - list.head) - kHeadWords;
    const std::uint64_t head = list.record | hits << kCountShift;
    std::memcpy(list.head, &head, sizeof head);
    list.hits += hits;
    list.head = nullptr;
    return hits;
}

void HitStore::grow(Slab &slab, List &list) {
    std::size_t capacity = kFirstChunk;
    if (!list.chunks.empty()) {
        Chunk &last = list.chunks.back();
        last.used = last.capacity - static_cast<std::size_t>(list.end - list.next);
        capacity = std::min(2 * last.capacity, kLargestChunk);
    }
    if (!slab.words || slab.used + capacity > kSlab)
        slab = {std::shared_ptr<Word[]>(new Word[kSlab])};
    list.chunks.push_back({{slab.words, slab.words.get() + slab.used}, capacity, 0});
    slab.used += capacity;
    list.next = list.chunks.back().words.get();
    list.end = list.next + capacity;
}

// Begins a record with room for `hits`, at most a chunk.
void HitStore::start(Writer &writer, List &list, std::uint64_t record, std::size_t hits) {
    writer.uncounted += finish(list);
    if (writer.uncounted >= kCountedAtOnce)
        counted_.fetch_add(std::exchange(writer.uncounted, 0), std::memory_order_relaxed);
    while (static_cast<std::size_t>(list.end - list.next) < kHeadWords + hits)
        grow(writer.slab, list);
    list.head = std::exchange(list.next, list.next + kHeadWords);
    list.record = record;
}

void HitStore::add(int writer, std::span<const MortonCode> codes, std::uint32_t source) {
    MortonCode differ = 0;
    for (const MortonCode code : codes)
        differ |= code ^ codes.front();
    if (differ > block_mask_ || codes.size() > kLargestChunk - kHeadWords) {
        for (const MortonCode code : codes)
            add(writer, code, source);
        return;
    }
    Writer &own = writers_[static_cast<std::size_t>(writer)];
    List &list = own.lists[codes.front() >> local_bits_];
    start(own, list, record_of(codes.front(), source), codes.size());
    std::transform(codes.begin(), codes.end(), std::exchange(list.next, list.next + codes.size()),
                   [this](MortonCode code) { return in_block(code); });
}

std::uint64_t HitStore::size() const {
    std::uint64_t hits = 0;
    for (const Writer &writer : writers_)
        for (const List &list : writer.lists) {
            hits += list.hits;
            if (list.head != nullptr)
                hits += static_cast<std::uint64_t>(list.next - list.head) - kHeadWords;
        }
    return hits;
}

void HitStore::take(std::size_t bucket, std::vector<Hit> &out) {
    for (Writer &writer : writers_) {
        List &list = writer.lists[bucket];
        if (list.chunks.empty())
            continue;
        finish(list);
        list.chunks.back().used = list.chunks.back().capacity - static_cast<std::size_t>(list.end - list.next);
        const std::size_t before = out.size();
        out.resize(before + list.hits);
        Hit *to = out.data() + before;
        for (const Chunk &chunk : list.chunks) {
            const Word *const end = chunk.words.get() + chunk.used;
            for (const Word *from = chunk.words.get(); from < end;) {
                std::uint64_t head = 0;
                std::memcpy(&head, from, sizeof head);
                from += kHeadWords;
                const std::uint64_t source = head & (kMaxSources - 1);
                const MortonCode block = (head & ((std::uint64_t{1} << kCountShift) - 1)) >> kSourceBits << kBlockBits;
                for (std::uint64_t left = head >> kCountShift; left > 0; --left)
                    *to++ = (block | *from++) << kSourceBits | source;
            }
        }
        list = List();
    }
}

} // namespace pbm::build
