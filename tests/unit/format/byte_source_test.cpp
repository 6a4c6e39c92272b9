#include "pbm_format/reading/load_model.h"
#include "system/byte_source.h"

#include "pbm_format/writing/writer.h"
#include "unit/support/network_file.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

namespace pbm {
namespace {

using test::NetworkFile;
using test::Random;

Bytes numbered(std::size_t size) {
    Bytes bytes(size);
    Random random(3);
    for (std::uint8_t &byte : bytes)
        byte = static_cast<std::uint8_t>(random.next());
    return bytes;
}

bool is_aligned(const HeldBytes &held, std::uint64_t offset) {
    return reinterpret_cast<std::uintptr_t>(held.bytes.data()) % 8 == offset % 8;
}

TEST(SparseFile, HoldsWhatWasFilledAndNotDroppedSince) {
    const Bytes file = numbered(400000);
    SparseFile sparse(file.size());
    std::vector<bool> there(file.size());
    Random random(7);
    int views = 0;
    for (int round = 0; round < 400; ++round) {
        const std::size_t offset = random.below(file.size());
        const std::size_t bytes = random.below(std::min<std::size_t>(file.size() - offset, 150000) + 1);
        const FileRange range{offset, bytes};
        const auto first = there.begin() + static_cast<std::ptrdiff_t>(offset);
        const auto last = first + static_cast<std::ptrdiff_t>(bytes);
        const bool is_there = std::all_of(first, last, [](bool byte) { return byte; });
        EXPECT_EQ(sparse.has(range), is_there);
        const std::optional<HeldBytes> held = sparse.view(range);
        ASSERT_EQ(held.has_value(), is_there);
        if (held && bytes > 0) {
            EXPECT_TRUE(
                std::equal(held->bytes.begin(), held->bytes.end(), file.begin() + static_cast<std::ptrdiff_t>(offset)));
            EXPECT_TRUE(is_aligned(*held, offset));
            ++views;
        }
        if (round % 3 == 2)
            sparse.drop(range);
        else
            sparse.fill(offset, slice(file, offset, bytes));
        std::fill(first, last, round % 3 != 2);
        EXPECT_EQ(sparse.memory(), static_cast<std::uint64_t>(std::count(there.begin(), there.end(), true)));
    }
    EXPECT_GT(views, 20);
}

TEST(SparseFile, KeepsWhatIsHeldWhenItIsDropped) {
    const Bytes file = numbered(100000);
    SparseFile sparse(file.size());
    sparse.fill(0, file);
    const HeldBytes held = sparse.view({10, 20}).value();
    sparse.drop({0, file.size()});
    EXPECT_FALSE(sparse.has({10, 20}));
    EXPECT_EQ(sparse.memory(), 0U);
    EXPECT_TRUE(std::equal(held.bytes.begin(), held.bytes.end(), file.begin() + 10));
}

TEST(SparseFile, IsLargerThanMemory) {
    constexpr std::uint64_t kSize = std::uint64_t{1} << 60;
    SparseFile sparse(kSize);
    const Bytes end = numbered(100);
    sparse.fill(kSize - 50, end); // half of the range lies past the end
    EXPECT_TRUE(sparse.has({kSize - 50, 50}));
    EXPECT_FALSE(sparse.view({kSize - 50, 51}));
    EXPECT_FALSE(sparse.view({kSize - 50, ~std::uint64_t{0}}));
    EXPECT_FALSE(sparse.view({~std::uint64_t{0}, 1}));
    EXPECT_EQ(sparse.memory(), 50U);
    sparse.fill(kSize, end);
    sparse.fill(~std::uint64_t{0}, end);
    EXPECT_EQ(sparse.memory(), 50U);
    sparse.drop({0, ~std::uint64_t{0}});
    EXPECT_EQ(sparse.memory(), 0U);
}

TEST(SparseFile, IsFilledAndReadByManyThreads) {
    const Bytes file = numbered(1 << 20);
    SparseFile sparse(file.size());
    std::vector<std::thread> threads;
    for (std::uint64_t thread = 0; thread < 4; ++thread)
        threads.emplace_back([&, thread] {
            Random random(thread);
            for (int i = 0; i < 200; ++i) {
                const FileRange range{random.below(file.size() - 50000), random.below(50000)};
                sparse.fill(range.offset, slice(file, range.offset, range.bytes));
                if (const auto held = sparse.view(range)) {
                    EXPECT_TRUE(std::equal(held->bytes.begin(), held->bytes.end(),
                                           file.begin() + static_cast<std::ptrdiff_t>(range.offset)));
                }
                sparse.drop({range.offset, range.bytes / 2});
            }
        });
    for (std::thread &thread : threads)
        thread.join();
}

TEST(ByteSource, OfAWholeFileHasItAllWhereItLies) {
    const Bytes file = numbered(1000);
    const ByteSource source{ByteView(file)};
    EXPECT_TRUE(source.is_whole());
    EXPECT_EQ(source.view({10, 20})->bytes.data(), file.data() + 10);
    EXPECT_EQ(source.view({10, 20})->owner, nullptr);
    EXPECT_TRUE(source.has({1000, 0}));
    EXPECT_FALSE(source.view({990, 11}));
    EXPECT_FALSE(source.view({~std::uint64_t{0}, 1}));
    source.drop({0, 1000});
    EXPECT_TRUE(source.has({0, 1000}));
}

TEST(ByteSource, SaysWhichBytesAWholeFileIsGoingToNeed) {
    static std::vector<ByteView> wanted;
    const Bytes file = numbered(1000);
    const ByteSource source(file, [](ByteView bytes) { wanted.push_back(bytes); });
    source.will_need({10, 20});
    source.will_need({990, 11});
    EXPECT_TRUE(source.view({500, 500}));
    EXPECT_FALSE(source.view({500, 501}));
    ASSERT_EQ(wanted.size(), 2U);
    EXPECT_EQ(wanted[0].data(), file.data() + 10);
    EXPECT_EQ(wanted[0].size(), 20U);
    EXPECT_EQ(wanted[1].data(), file.data() + 500);
}

const Bytes &file(Storage storage) {
    static const auto make = [](Storage of) {
        const Model model = test::sphere_model(5, test::every_attribute(ColourFormat::rgb565, 5));
        return value_of(encode_model(model, {.storage = of, .chunk_points = 512, .threads = 1}));
    };
    static const Bytes packed = make(Storage::packed), mapped = make(Storage::mapped);
    return storage == Storage::packed ? packed : mapped;
}

TEST(SparseReader, OpensWithWhatItAsksFor) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        NetworkFile network(file(storage));
        EXPECT_EQ(Reader::open(network.source()).error().code, ErrorCode::usage);
        const Reader reader = network.open();
        EXPECT_EQ(network.ranges(), 3U); // header, table, small sections
        EXPECT_LT(network.bytes(), 4000U);
        const Reader whole = value_of(Reader::open(file(storage)));
        EXPECT_EQ(reader.header().content_id, whole.header().content_id);
        EXPECT_EQ(reader.metadata(), whole.metadata());
        EXPECT_EQ(reader.parameters().materials.size(), whole.parameters().materials.size());
    }
}

TEST(SparseReader, TellsDamageOfTheStartAsOpenDoes) {
    for (const std::size_t at : {0U, 9U, 60U, 130U, 1200U}) {
        Bytes damaged = file(Storage::packed);
        damaged[at] ^= 1;
        NetworkFile network(damaged);
        for (FileRange range = Reader::opening_range(network.source()); range.bytes > 0;
             range = Reader::opening_range(network.source()))
            network.fetch(range);
        const Error expected = Reader::open(damaged).error(), error = Reader::open(network.source()).error();
        EXPECT_EQ(error.code, expected.code) << at;
        EXPECT_EQ(error.offset, expected.offset) << at;
        EXPECT_EQ(error.rule, expected.rule) << at;
    }
    for (const std::size_t size : {0U, 5U, 127U, 128U, 500U}) {
        const Bytes cut(file(Storage::packed).begin(),
                        file(Storage::packed).begin() + static_cast<std::ptrdiff_t>(size));
        NetworkFile network(cut);
        for (FileRange range = Reader::opening_range(network.source()); range.bytes > 0;
             range = Reader::opening_range(network.source()))
            network.fetch(range);
        EXPECT_EQ(Reader::open(network.source()).error().code, Reader::open(cut).error().code) << size;
    }
}

// Reading a range that has not arrived is a `usage` error, not damage. The same reader loads it after it arrives.
TEST(SparseReader, LoadsAModelRangeByRange) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Reader whole = value_of(Reader::open(file(storage)));
        const Model expected = value_of(load_model(whole, {.threads = 1}));
        NetworkFile network(file(storage));
        Reader reader = network.open();
        std::size_t refused = 0;
        Result<Model> model = load_model(reader, {.threads = 2});
        for (; !model && refused < 1000; model = load_model(reader, {.threads = 2})) {
            EXPECT_EQ(model.error().code, ErrorCode::usage);
            ++refused;
            const std::uint64_t offset = model.error().offset;
            network.fetch(FileRange{offset, std::min<std::uint64_t>(8192, file(storage).size() - offset)});
        }
        ASSERT_TRUE(model);
        EXPECT_GE(refused, 3U);
        ASSERT_EQ(model->levels.size(), expected.levels.size());
        for (std::size_t level = 0; level < expected.levels.size(); ++level) {
            EXPECT_EQ(model->levels[level].masks, expected.levels[level].masks);
            EXPECT_EQ(model->levels[level].points, expected.levels[level].points);
        }
    }
}

TEST(SparseReader, NamesADamagedChunkAsAWholeFileDoes) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Bytes damaged = file(storage);
        Reader whole = value_of(Reader::open(file(storage)));
        const ChunkEntry entry = value_of(whole.directory(5))->chunks[2];
        damaged[entry.offset + entry.stored_bytes / 2] ^= 1;
        const auto network = std::make_shared<SparseFile>(damaged.size());
        network->fill(0, damaged);
        Reader reader = value_of(Reader::open(ByteSource(network)));
        const Result<Model> model = load_model(reader);
        ASSERT_FALSE(model);
        EXPECT_EQ(model.error().code, ErrorCode::bad_hash);
        EXPECT_EQ(model.error().offset, entry.offset);
        // The undamaged bytes arrive: the same reader accepts them.
        network->drop(chunk_range(entry));
        network->fill(entry.offset, slice(file(storage), entry.offset, entry.stored_bytes));
        EXPECT_TRUE(load_model(reader).ok());
    }
}

} // namespace
} // namespace pbm
