// XXH3-128 of a text whose pieces arrive in any order, for programs that never hold the whole text. BVG.md 1.3
#pragma once

#include "pbm_format/hashes/hash.h"

#include <map>
#include <mutex>
#include <vector>

namespace pbm {

// XXH3 adds up the words of a block of 1,024 bytes, in any order, and only then mixes the block into its state. So the
// sums of each block, 64 bytes, are all that has to be kept of a text until its pieces are there. If even these are too
// many, the text is added in several rounds: each round keeps the sums of a part of the blocks.
//
//   UnorderedHash hash(size, max_memory);
//   do {
//       ... hash.add(at, piece);     for all pieces, in any order
//   } while (hash.begin_round());
//   hash.finish()
class UnorderedHash {
  public:
    // `size`: bytes of the whole text; `max_memory`: bytes for the sums, of which at least 64 are used.
    UnorderedHash(std::uint64_t size, std::uint64_t max_memory);
    // What the sums take if one round is to suffice, bytes.
    static std::uint64_t memory(std::uint64_t size);

    // Adds the bytes of the text from `at` on, which must lie within it. Each byte is added once a round. Safe to call
    // from several threads.
    void add(std::uint64_t at, ByteView bytes);
    // Whether this round needs any of the `bytes` bytes from `at` on.
    bool needs(std::uint64_t at, std::uint64_t bytes) const {
        return is_summed(at, bytes) || (first_block_ == 0 && at + bytes > size_ - end_.size());
    }
    // After all bytes were added: begins the next round. False: there is none, the hash is complete.
    bool begin_round();
    Hash128 finish() const;

  private:
    using Sums = std::array<std::uint64_t, 8>;
    // A word whose bytes come in several pieces.
    struct OpenWord {
        std::uint64_t bits = 0;
        std::size_t bytes = 0;
    };

    std::uint64_t round_begin() const;
    std::uint64_t round_end() const;
    // Whether some of these bytes go into the sums of this round.
    bool is_summed(std::uint64_t at, std::uint64_t bytes) const {
        return at < round_end() && at + bytes > round_begin();
    }
    void add_part_of_word(std::uint64_t at, ByteView bytes);
    void add_words(std::uint64_t first, ByteView bytes);

    std::uint64_t size_;
    std::uint64_t summed_;   // bytes from the start that the sums cover; the rest is in the end
    alignas(64) Sums state_; // of the blocks before the round's
    std::uint64_t first_block_ = 0;
    std::vector<Sums> blocks_; // of the round
    Bytes end_;                // the last bytes of the text: kStripeBytes of them, all of a short text
    std::mutex mutex_;         // guards open_words_, and the blocks at the ends of a piece
    std::map<std::uint64_t, OpenWord> open_words_; // by number
};

} // namespace pbm
