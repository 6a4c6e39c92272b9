// Pairs of a voxel and a triangle or point in it, in one bucket per node of a coarse octree level, so that voxelize can
// process and free one bucket after the other, within the cache.
#pragma once

#include "pbm_format/model/octree.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace pbm::build {

// One triangle or point in one voxel, 64 bits: [63..31] Morton code of the voxel within its bucket, [30..0] source.
using Hit = std::uint64_t;
inline constexpr int kSourceBits = 31;
inline constexpr std::uint64_t kMaxSources = std::uint64_t{1} << kSourceBits; // triangles or points of one surface

inline std::uint32_t source_of(Hit hit) { return static_cast<std::uint32_t>(hit & (kMaxSources - 1)); }
inline MortonCode local_code_of(Hit hit) { return hit >> kSourceBits; }

// Consecutive buckets: a range of the Morton curve.
struct BucketRange {
    std::size_t first = 0, last = 0; // one behind
    bool holds(std::size_t bucket) const { return first <= bucket && bucket < last; }
};

// Each writer belongs to one thread. The order of hits within a bucket depends on the threads; results computed from
// them must not.
//
// Consecutive hits in a bucket mostly belong to one triangle in one block: they are stored as a record of 8 bytes for
// the source and 2 bytes per voxel.
class HitStore {
  public:
    // Bits of a Morton code within a block of 32x32x32 voxels, the unit of voxelize. A bucket is one block where the
    // depth allows, else several.
    static constexpr int kBlockBits = 15;

    // full() becomes true soon after the hits exceed `max_hits`; the caller then stops.
    HitStore(int depth, int writers, std::uint64_t max_hits);

    // Octree level of the buckets' nodes.
    static int bucket_level(int depth);
    std::size_t bucket_count() const { return std::size_t{1} << (3 * bucket_level_); }
    BucketRange all_buckets() const { return {0, bucket_count()}; }
    int local_bits() const { return local_bits_; } // of a Morton code within its bucket, at most 33
    int writers() const { return static_cast<int>(writers_.size()); }
    std::uint64_t max_hits() const { return max_hits_; }
    bool full() const { return counted_.load(std::memory_order_relaxed) > max_hits_; }
    std::uint64_t size() const; // hits

    void add(int writer, MortonCode code, std::uint32_t source) {
        Writer &own = writers_[static_cast<std::size_t>(writer)];
        List &list = own.lists[code >> local_bits_];
        const std::uint64_t record = record_of(code, source);
        if (record != list.record || list.next == list.end)
            start(own, list, record, 1);
        *list.next++ = in_block(code);
    }

    // Adds one source in several voxels, at least one; fastest if all lie in one block.
    void add(int writer, std::span<const MortonCode> codes, std::uint32_t source);

    // Appends the hits of one bucket to `out`, each writer's in their order, and frees their memory. Several threads
    // may take different buckets.
    void take(std::size_t bucket, std::vector<Hit> &out);

  private:
    // Records one after the other. Each: 64 bits, [63..49] hits, [48..31] block within the bucket, [30..0] source;
    // then the voxel of each hit within the block.
    using Word = std::uint16_t;
    static constexpr std::size_t kHeadWords = 4;
    static constexpr int kCountShift = 49;
    struct Chunk {
        std::shared_ptr<Word[]> words; // of a slab
        std::size_t capacity, used;
    };
    // A block of the heap that chunks of one writer share: large, so that it may lie in a file (tools/pbm-build).
    struct Slab {
        std::shared_ptr<Word[]> words{};
        std::size_t used = 0;
    };
    struct List {
        Word *next = nullptr, *end = nullptr;               // room that is left
        Word *head = nullptr;                               // of the last record, whose hits are not yet counted
        std::uint64_t record = ~std::uint64_t{0}, hits = 0; // the last record without its hits; those of all others
        std::vector<Chunk> chunks;
    };
    struct Writer {
        std::vector<List> lists; // [bucket_count()]
        Slab slab{};             // of the next chunks
        std::uint64_t uncounted = 0;
    };

    Word in_block(MortonCode code) const { return static_cast<Word>(code & block_mask_); }
    std::uint64_t record_of(MortonCode code, std::uint32_t source) const {
        return (code & local_mask_) >> kBlockBits << kSourceBits | source;
    }
    void start(Writer &writer, List &list, std::uint64_t record, std::size_t hits);
    static void grow(Slab &slab, List &list);
    static std::uint64_t finish(List &list);

    int bucket_level_;
    int local_bits_;
    MortonCode local_mask_, block_mask_; // bits within a bucket, within a block of it
    std::uint64_t max_hits_;
    std::atomic<std::uint64_t> counted_{0}; // hits, but for the last ones of each writer
    std::vector<Writer> writers_;
};

} // namespace pbm::build
