// Each implementation of hash64 against libxxhash, which only this test links.
#include "pbm_format/hashes/hash.h"
#include "pbm_format/hashes/hash_ways.h"
#include "pbm_format/hashes/unordered_hash.h"

#include "unit/support/test_models.h"

#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <string>

namespace pbm {
namespace {

Bytes random_bytes(std::size_t size) {
    test::Random random(7);
    Bytes bytes(size);
    std::generate(bytes.begin(), bytes.end(), [&] { return static_cast<std::uint8_t>(random.next()); });
    return bytes;
}

void expect_xxh3(const HashWay &way, ByteView bytes) {
    ASSERT_EQ(way.hash(bytes.data(), bytes.size()), XXH3_64bits(bytes.data(), bytes.size()))
        << way.name << ", " << bytes.size() << " bytes from " << reinterpret_cast<std::uintptr_t>(bytes.data()) % 64;
}

// Start offsets 0..63: more than the alignment of any vector register.
constexpr std::size_t kStarts = 64;

TEST(Hash, TheLastImplementationIsForEveryProcessor) {
    ASSERT_FALSE(hash_ways().empty());
    EXPECT_TRUE(hash_ways().back().supported);
}

TEST(Hash, EveryImplementationIsXxh3AtAllLengthsUpTo5000) {
    constexpr std::size_t kLongest = 5000;
    const Bytes bytes = random_bytes(kLongest + kStarts);
    for (const HashWay &way : hash_ways())
        for (std::size_t size = 0; way.supported && size <= kLongest; ++size)
            ASSERT_NO_FATAL_FAILURE(expect_xxh3(way, ByteView(bytes).subspan(size % kStarts, size)));
}

// Lengths around those where XXH3 changes its algorithm, and around the ends of stripes and blocks.
TEST(Hash, EveryImplementationIsXxh3FromAllStarts) {
    const Bytes bytes = random_bytes(4096 + kStarts);
    for (const HashWay &way : hash_ways())
        for (const std::size_t about : {1U, 4U, 9U, 17U, 64U, 129U, 241U, 256U, 1024U, 2048U, 4095U})
            for (std::size_t start = 0; way.supported && start < kStarts; ++start)
                for (std::size_t size = about - 1; size <= about + 1; ++size)
                    ASSERT_NO_FATAL_FAILURE(expect_xxh3(way, ByteView(bytes).subspan(start, size)));
}

TEST(Hash, EveryImplementationIsXxh3AtSomeLengthsUpTo300000) {
    constexpr std::size_t kLongest = 300000;
    const Bytes bytes = random_bytes(kLongest + kStarts);
    for (const HashWay &way : hash_ways())
        for (std::size_t size = 5001, step = 1; way.supported && size <= kLongest; size += step, step += 97)
            ASSERT_NO_FATAL_FAILURE(expect_xxh3(way, ByteView(bytes).subspan(size % kStarts, size)));
}

TEST(Hash, TheChosenImplementationIsXxh3) {
    const Bytes bytes = random_bytes(70000);
    for (const std::size_t size : {0U, 1U, 100U, 240U, 241U, 1000U, 70000U})
        EXPECT_EQ(hash64(ByteView(bytes).first(size)), XXH3_64bits(bytes.data(), size)) << size;
}

TEST(Hash, PiecesHashLikeTheWhole) {
    const Bytes bytes = random_bytes(20000);
    const XXH128_hash_t expected = XXH3_128bits(bytes.data(), bytes.size());
    for (const std::size_t piece : {1U, 7U, 255U, 256U, 257U, 1023U, 1024U, 20000U}) {
        StreamingHash hash;
        for (std::size_t at = 0; at < bytes.size(); at += piece)
            hash.add(ByteView(bytes).subspan(at, std::min(piece, bytes.size() - at)));
        EXPECT_EQ(hash.finish(), (Hash128{expected.low64, expected.high64})) << piece;
    }
}

// The text in random pieces and random order, with memory for `blocks` blocks of 1,024 bytes.
Hash128 hash_unordered(ByteView text, std::uint64_t longest_piece, std::uint64_t blocks, test::Random &random) {
    std::vector<std::pair<std::size_t, std::size_t>> pieces; // begin and size
    for (std::size_t at = 0; at < text.size();) {
        const auto size = std::min(text.size() - at, static_cast<std::size_t>(1 + random.below(longest_piece)));
        pieces.emplace_back(at, size);
        at += size;
    }
    for (std::size_t i = pieces.size(); i > 1; --i)
        std::swap(pieces[i - 1], pieces[static_cast<std::size_t>(random.below(i))]);
    UnorderedHash hash(text.size(), 64 * blocks);
    do {
        for (const auto &[at, size] : pieces)
            if (hash.needs(at, size))
                hash.add(at, text.subspan(at, size));
    } while (hash.begin_round());
    return hash.finish();
}

void expect_unordered(ByteView text, std::uint64_t longest_piece, std::uint64_t blocks, test::Random &random) {
    StreamingHash whole;
    whole.add(text);
    ASSERT_EQ(hash_unordered(text, longest_piece, blocks, random), whole.finish())
        << text.size() << " bytes in pieces of up to " << longest_piece << ", " << blocks << " blocks a round";
}

TEST(Hash, PiecesInAnyOrderGiveTheHashOfTheText) {
    const Bytes bytes = random_bytes(300000);
    test::Random random(11);
    for (std::size_t size = 0; size <= 2500; ++size)
        for (const std::uint64_t longest : {20U, 2000U})
            ASSERT_NO_FATAL_FAILURE(expect_unordered(ByteView(bytes).first(size), longest, 1000, random));
    for (int i = 0; i < 50; ++i)
        ASSERT_NO_FATAL_FAILURE(
            expect_unordered(ByteView(bytes).first(static_cast<std::size_t>(random.below(bytes.size()))),
                             1 + random.below(30000), 1000, random));
}

TEST(Hash, PiecesMayComeInSeveralRounds) {
    const Bytes bytes = random_bytes(20000);
    test::Random random(12);
    for (std::size_t size = 0; size <= bytes.size(); size += 1 + static_cast<std::size_t>(random.below(200)))
        for (const std::uint64_t blocks : {0U, 1U, 3U})
            ASSERT_NO_FATAL_FAILURE(expect_unordered(ByteView(bytes).first(size), 700, blocks, random));
}

} // namespace
} // namespace pbm
