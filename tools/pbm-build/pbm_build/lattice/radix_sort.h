// Radix sort of 64-bit words by some of their bits: the least significant digit first. Many words are divided by their
// most significant digit before, so that each part is sorted within the cache, and memory that is paged
// (system/processes/paged_heap.h) is gone through twice instead of once for each digit.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace pbm::build {

// Sorts `words` ascending by bits [low_bit, low_bit + bits); stable. `spare` is scratch memory.
inline void radix_sort(std::vector<std::uint64_t> &words, std::vector<std::uint64_t> &spare, int low_bit, int bits) {
    constexpr int kDigitBits = 11;
    constexpr std::uint64_t kDigitMask = (1U << kDigitBits) - 1;
    const std::uint64_t key_mask = bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    if (words.size() < 512) { // clearing the counters would take longer
        std::stable_sort(words.begin(), words.end(), [&](std::uint64_t a, std::uint64_t b) {
            return (a >> low_bit & key_mask) < (b >> low_bit & key_mask);
        });
        return;
    }
    spare.resize(words.size());
    constexpr std::size_t kMany = std::size_t{1} << 22;
    if (words.size() > kMany && bits > kDigitBits) {
        const int rest = bits - kDigitBits, shift = low_bit + rest;
        std::array<std::size_t, kDigitMask + 2> end{}; // [digit + 1] of its words in `spare`
        for (const std::uint64_t word : words)
            ++end[(word >> shift & kDigitMask) + 1];
        for (std::size_t digit = 1; digit < end.size(); ++digit)
            end[digit] += end[digit - 1];
        for (const std::uint64_t word : words)
            spare[end[word >> shift & kDigitMask]++] = word;
        words.swap(spare);
        std::vector<std::uint64_t> part, part_spare;
        std::size_t begin = 0;
        for (std::size_t digit = 0; digit <= kDigitMask; begin = end[digit++]) {
            const auto first = words.begin() + static_cast<std::ptrdiff_t>(begin);
            part.assign(first, words.begin() + static_cast<std::ptrdiff_t>(end[digit]));
            radix_sort(part, part_spare, low_bit, rest);
            std::copy(part.begin(), part.end(), first);
        }
        return;
    }
    for (int done = 0; done < bits; done += kDigitBits) {
        const int shift = low_bit + done;
        const std::uint64_t mask = std::min(kDigitMask, key_mask >> done);
        std::array<std::size_t, kDigitMask + 1> place{};
        for (const std::uint64_t word : words)
            ++place[word >> shift & mask];
        std::size_t before = 0;
        for (std::size_t &digit : place)
            before += std::exchange(digit, before);
        for (const std::uint64_t word : words)
            spare[place[word >> shift & mask]++] = word;
        words.swap(spare);
    }
}

} // namespace pbm::build
