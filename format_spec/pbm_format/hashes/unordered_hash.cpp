// XXH3 for long inputs, as its specification describes it: github.com/Cyan4973/xxHash, doc/xxhash_spec.md.
#include "pbm_format/hashes/unordered_hash.h"

#include <algorithm>
#include <cassert>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace pbm {

namespace {

constexpr std::size_t kWordBytes = 8, kStripeBytes = 64, kBlockBytes = 1024, kSecretBytes = XXH_SECRET_DEFAULT_SIZE;
constexpr std::size_t kMaxShort = 240; // bytes of a text that XXH3 hashes in another way
static_assert(kBlockBytes == (kSecretBytes - kStripeBytes) / kWordBytes * kStripeBytes);

} // namespace

UnorderedHash::UnorderedHash(std::uint64_t size, std::uint64_t max_memory)
    : size_(size), summed_(size <= kMaxShort ? 0 : (size - 1) / kStripeBytes * kStripeBytes), state_(XXH3_INIT_ACC),
      end_(size <= kMaxShort ? static_cast<std::size_t>(size) : kStripeBytes) {
    const std::uint64_t blocks = (summed_ + kBlockBytes - 1) / kBlockBytes;
    blocks_.resize(
        static_cast<std::size_t>(std::min(blocks, std::max<std::uint64_t>(1, addressable(max_memory) / sizeof(Sums)))));
}

std::uint64_t UnorderedHash::memory(std::uint64_t size) { return (size / kBlockBytes + 1) * sizeof(Sums); }

std::uint64_t UnorderedHash::round_begin() const { return kBlockBytes * first_block_; }
std::uint64_t UnorderedHash::round_end() const {
    return std::min(summed_, kBlockBytes * (first_block_ + std::uint64_t{blocks_.size()}));
}

void UnorderedHash::add(std::uint64_t at, ByteView bytes) {
    assert(at <= size_ && bytes.size() <= size_ - at);
    const std::uint64_t end = at + bytes.size(), end_at = size_ - end_.size();
    if (end > end_at) {
        const std::uint64_t from = std::max(at, end_at);
        const ByteView last = slice(bytes, from - at, end - from);
        std::copy(last.begin(), last.end(), end_.begin() + static_cast<std::ptrdiff_t>(from - end_at));
    }
    if (!is_summed(at, bytes.size()))
        return;
    const std::uint64_t from = std::max(at, round_begin());
    bytes = slice(bytes, from - at, std::min(end, round_end()) - from);
    at = from;
    const std::size_t head =
        std::min(bytes.size(), static_cast<std::size_t>((kWordBytes - at % kWordBytes) % kWordBytes));
    const std::size_t words = (bytes.size() - head) / kWordBytes;
    add_part_of_word(at, bytes.first(head));
    add_words((at + head) / kWordBytes, bytes.subspan(head, kWordBytes * words));
    add_part_of_word(at + head + kWordBytes * words, bytes.subspan(head + kWordBytes * words));
}

void UnorderedHash::add_part_of_word(std::uint64_t at, ByteView bytes) {
    if (bytes.empty())
        return;
    std::array<std::uint8_t, kWordBytes> word{};
    {
        const std::lock_guard lock(mutex_);
        OpenWord &open = open_words_[at / kWordBytes];
        for (std::size_t i = 0; i < bytes.size(); ++i)
            open.bits |= std::uint64_t{bytes[i]} << 8 * (at % kWordBytes + i);
        open.bytes += bytes.size();
        if (open.bytes < kWordBytes)
            return;
        for (std::size_t i = 0; i < kWordBytes; ++i)
            word[i] = static_cast<std::uint8_t>(open.bits >> 8 * i);
        open_words_.erase(at / kWordBytes);
    }
    add_words(at / kWordBytes, word);
}

void UnorderedHash::add_words(std::uint64_t first, ByteView bytes) {
    constexpr std::size_t kWordsOfBlock = kBlockBytes / kWordBytes, kWordsOfStripe = kStripeBytes / kWordBytes;
    for (std::size_t at = 0; at < bytes.size();) {
        const std::uint64_t word = first + at / kWordBytes;
        const auto start = static_cast<std::size_t>(word % kWordsOfBlock);
        const std::size_t end = std::min(kWordsOfBlock, start + (bytes.size() - at) / kWordBytes);
        alignas(64) Sums sums{};
        for (std::size_t w = start; w < end;) {
            const std::size_t of_stripe = w % kWordsOfStripe, secret = kWordBytes * (w / kWordsOfStripe);
            if (of_stripe == 0 && end - w >= kWordsOfStripe) {
                XXH3_accumulate_512(sums.data(), bytes.data() + at, XXH3_kSecret + secret);
                w += kWordsOfStripe;
                at += kStripeBytes;
                continue;
            }
            const std::uint64_t value = XXH_readLE64(bytes.data() + at);
            const std::uint64_t keyed = value ^ XXH_readLE64(XXH3_kSecret + secret + kWordBytes * of_stripe);
            sums[of_stripe ^ 1] += value;
            sums[of_stripe] += (keyed & 0xFFFFFFFF) * (keyed >> 32);
            ++w;
            at += kWordBytes;
        }
        Sums &block = blocks_[static_cast<std::size_t>(word / kWordsOfBlock - first_block_)];
        if (start == 0 && end == kWordsOfBlock) { // nobody else adds to this block
            block = sums;
            continue;
        }
        const std::lock_guard lock(mutex_);
        for (std::size_t i = 0; i < sums.size(); ++i)
            block[i] += sums[i];
    }
}

bool UnorderedHash::begin_round() {
    open_words_.clear();                                                      // empty, unless bytes are missing
    const std::uint64_t whole = summed_ == 0 ? 0 : (size_ - 1) / kBlockBytes; // blocks that end before the text does
    for (std::size_t b = 0; b < blocks_.size() && first_block_ + b < (summed_ + kBlockBytes - 1) / kBlockBytes; ++b) {
        for (std::size_t i = 0; i < state_.size(); ++i)
            state_[i] += blocks_[b][i];
        if (first_block_ + b < whole)
            XXH3_scrambleAcc(state_.data(), XXH3_kSecret + kSecretBytes - kStripeBytes);
    }
    first_block_ += blocks_.size();
    std::fill(blocks_.begin(), blocks_.end(), Sums{});
    return round_begin() < summed_;
}

Hash128 UnorderedHash::finish() const {
    if (size_ <= kMaxShort) {
        const XXH128_hash_t hash = XXH3_128bits(end_.data(), end_.size());
        return {hash.low64, hash.high64};
    }
    alignas(64) Sums state = state_;
    XXH3_accumulate_512(state.data(), end_.data(), XXH3_kSecret + kSecretBytes - kStripeBytes - 7);
    return {XXH3_mergeAccs(state.data(), XXH3_kSecret + 11, size_ * XXH_PRIME64_1),
            XXH3_mergeAccs(state.data(), XXH3_kSecret + kSecretBytes - kStripeBytes - 11, ~(size_ * XXH_PRIME64_2))};
}

} // namespace pbm
