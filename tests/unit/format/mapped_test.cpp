// Mapped files: the same model as the packed file, used without a copy, and every byte is verified.
#include "pbm_format/checking/validate.h"
#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "system/threads/parallel.h"

#include "unit/support/file_damage.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <hwy/targets.h>

namespace pbm {
namespace {

Bytes encode(const Model &model, Storage storage, std::uint32_t chunk_points = 512) {
    return value_of(encode_model(model, {.storage = storage, .chunk_points = chunk_points, .threads = 1}));
}

Reader open_with_directories(ByteView file) {
    Reader reader = value_of(Reader::open(file));
    EXPECT_TRUE(reader.directory(reader.depth()));
    return reader;
}

// Several chunks at levels 4 and 5.
const Bytes &many_chunks_file() {
    static const Bytes file =
        encode(test::sphere_model(5, test::every_attribute(ColourFormat::rgb888, 5)), Storage::mapped);
    return file;
}

std::vector<MortonCode> codes_of_level(const Model &model, std::size_t level) {
    std::vector<MortonCode> codes{0};
    for (std::size_t next = 1; next <= level; ++next)
        codes = value_of(expand_level(codes, model.levels[next].masks, std::size_t{1} << 24));
    return codes;
}

TEST(MappedStorage, HoldsTheSameModelAsPacked) {
    for (const ColourFormat colour : {ColourFormat::none, ColourFormat::rgb565, ColourFormat::rgb888})
        for (const int depth : {2, 3, 5, 6}) {
            const Model model = test::sphere_model(depth, test::every_attribute(colour, depth));
            const Bytes packed = encode(model, Storage::packed), mapped = encode(model, Storage::mapped);
            Reader reader = value_of(Reader::open(mapped));
            EXPECT_EQ(reader.header().content_id, value_of(Reader::open(packed)).header().content_id);
            EXPECT_EQ(value_of(load_model(reader, {.threads = 1})), model);
            EXPECT_TRUE(test::read_everything(mapped)) << test::read_everything(mapped).error().message;
            EXPECT_TRUE(validate(mapped, {.threads = 1}).valid());
        }
}

TEST(MappedStorage, BytesDoNotDependOnThreads) {
    const Model model = test::sphere_model(6, test::every_attribute(ColourFormat::rgb888, 6));
    EXPECT_EQ(encode(model, Storage::mapped),
              value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = 512, .threads = 8})));
}

TEST(MappedStorage, StreamsLieAlignedInTheFileAndChunksOnPages) {
    const Bytes &file = many_chunks_file();
    const Reader reader = open_with_directories(file);
    const auto place = [&](const auto &view) {
        return reinterpret_cast<const std::uint8_t *>(view.data()) - file.data();
    };
    for (int level = 1; level <= 5; ++level) {
        const auto instance = static_cast<std::uint32_t>(level);
        EXPECT_EQ(reader.section(SectionType::level_chunks, instance)->offset % 4096, 0U);
        const ChunkView view = value_of(reader.view_chunk(level, 0));
        EXPECT_EQ(place(view.masks), reader.section(SectionType::level_chunks, instance)->offset);
        EXPECT_EQ(place(view.bricks), reader.section(SectionType::level_bricks, instance)->offset);
        for (const std::ptrdiff_t at :
             {place(view.masks), place(view.normals), place(view.radii), place(view.colours), place(view.materials),
              place(view.textures), place(view.shadows[1]), place(view.bricks)})
            EXPECT_EQ(at % 64, 0);
    }
}

TEST(MappedStorage, ViewsShowWhatChunksOfAPackedFileHold) {
    const Model model = test::sphere_model(6, test::every_attribute(ColourFormat::rgb565, 6));
    const Bytes mapped = encode(model, Storage::mapped);
    const Reader reader = open_with_directories(mapped);
    Reader again = value_of(Reader::open(mapped));
    const LevelDirectory &directory = **again.directory(6);
    const Level &finest = model.levels[6];
    for (std::size_t i = 0; i < directory.chunks.size(); ++i) {
        const ChunkEntry &entry = directory.chunks[i];
        const ChunkView view = value_of(reader.view_chunk(6, i));
        const PointView expected =
            view_points(finest.points, entry.first_point, entry.shape.points, model.parameters.attributes);
        EXPECT_TRUE(std::equal(view.masks.begin(), view.masks.end(),
                               finest.masks.begin() + static_cast<std::ptrdiff_t>(entry.first_node)));
        EXPECT_TRUE(std::ranges::equal(view.normals, expected.normals));
        EXPECT_TRUE(std::ranges::equal(view.radii, expected.radii));
        EXPECT_TRUE(std::ranges::equal(view.colours, expected.colours));
        EXPECT_TRUE(std::ranges::equal(view.materials, expected.materials));
        EXPECT_TRUE(std::ranges::equal(view.textures, expected.textures));
        EXPECT_TRUE(std::ranges::equal(view.shadows[0], pack_bits(expected.shadows[0], 1)));
        EXPECT_EQ(view.bricks.size(), entry.shape.bricks);
    }
}

// A brick by the definition of BVG.md 5.11, from Morton codes.
struct PlainBrick {
    std::uint64_t node_map = 0;
    std::size_t first_node = 0;
    std::vector<std::size_t> points;
};

std::map<MortonCode, PlainBrick> plain_bricks(const Model &model, std::size_t level) {
    std::map<MortonCode, PlainBrick> bricks;
    const std::vector<MortonCode> nodes = codes_of_level(model, level - 1), points = codes_of_level(model, level);
    for (std::size_t i = nodes.size(); i-- > 0;) {
        PlainBrick &brick = bricks[nodes[i] >> 6];
        brick.node_map |= std::uint64_t{1} << (nodes[i] & 63);
        brick.first_node = i;
    }
    for (std::size_t i = 0; i < points.size(); ++i)
        bricks[points[i] >> 9].points.push_back(i);
    return bricks;
}

void expect_tight_cone(const BrickRecord &record, const PlainBrick &brick, std::span<const std::uint16_t> normals) {
    ASSERT_NE(record.cone_cosine, kNoCone);
    const auto &table = integer_normal_table();
    const IntegerNormal &axis = table[record.cone_axis];
    std::int64_t least = std::int64_t{32767} * 32767;
    std::array<double, 3> sum{};
    for (const std::size_t point : brick.points) {
        const IntegerNormal &n = table[normals[point] & kNormalIndexMask];
        std::int64_t product = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            product += std::int64_t{n[c]} * axis[c];
            sum[c] += n[c];
        }
        least = std::min(least, product);
    }
    EXPECT_LE(record.cone_cosine * std::int64_t{32767}, least);
    EXPECT_GT((record.cone_cosine + 1) * std::int64_t{32767}, least);
    // The axis is the table normal whose triangle contains the sum: at most 3.6 degrees away.
    const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    EXPECT_GT(sum[0] * axis[0] + sum[1] * axis[1] + sum[2] * axis[2], 0.998 * 32767 * length);
}

TEST(Bricks, AreWhatThePlainReadingOfTheOctreeGives) {
    Model model = test::sphere_model(6, {});
    std::vector<std::uint16_t> &finest = model.levels.back().points.normals;
    for (std::size_t i = 0; i < finest.size(); i += 1000)
        finest[i] |= kTwoSidedBit;
    average_levels(model, 1);
    const Bytes file = encode(model, Storage::mapped);
    Reader reader = value_of(Reader::open(file));
    std::size_t two_sided = 0;
    for (int level = 1; level <= 6; ++level) {
        const auto bricks = plain_bricks(model, static_cast<std::size_t>(level));
        const PointAttributes &points = model.levels[static_cast<std::size_t>(level)].points;
        auto expected = bricks.begin();
        const LevelDirectory &directory = **reader.directory(level);
        for (std::size_t i = 0; i < directory.chunks.size(); ++i) {
            const ChunkView view = value_of(reader.view_chunk(level, i));
            for (const BrickRecord &record : view.bricks) {
                ASSERT_NE(expected, bricks.end());
                const auto &[code, brick] = *expected++;
                EXPECT_EQ(morton_encode(record.x, record.y, record.z), code);
                EXPECT_EQ(record.node_map, brick.node_map);
                EXPECT_EQ(record.first_node + directory.chunks[i].first_node, brick.first_node);
                EXPECT_EQ(record.first_point + directory.chunks[i].first_point, brick.points.front());
                bool turns = false;
                std::uint8_t radius = 0;
                for (const std::size_t point : brick.points) {
                    turns |= (points.normals[point] & kTwoSidedBit) != 0;
                    radius = std::max(radius, points.radii[point]);
                }
                EXPECT_EQ(record.flags, turns ? kTwoSidedBrick : 0);
                EXPECT_EQ(record.largest_radius, radius);
                if (turns) {
                    EXPECT_EQ(record.cone_axis, 0);
                    EXPECT_EQ(record.cone_cosine, kNoCone);
                    ++two_sided;
                } else if (level > 2) {
                    expect_tight_cone(record, brick, points.normals);
                }
            }
        }
        EXPECT_EQ(expected, bricks.end());
    }
    EXPECT_GT(two_sided, 5U);
}

TEST(Bricks, AreTheSameOnEveryProcessor) {
    const Model model = test::sphere_model(6, {});
    const Bytes expected = encode(model, Storage::mapped);
    int tried = 0;
    for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1, ++tried) {
        const std::int64_t one = targets & -targets;
        hwy::SetSupportedTargetsForTest(one);
        EXPECT_EQ(encode(model, Storage::mapped), expected) << hwy::TargetName(one);
    }
    hwy::SetSupportedTargetsForTest(0);
    EXPECT_GE(tried, HWY_ARCH_X86 ? 2 : 1);
}

TEST(Bricks, StayInBoundsWhateverTheBytes) {
    test::Random random(5);
    for (int round = 0; round < 2000; ++round) {
        const auto bytes = [&](std::size_t size) {
            Bytes made(size);
            for (std::uint8_t &byte : made)
                byte = static_cast<std::uint8_t>(random.next());
            return made;
        };
        std::vector<BrickRecord> above(random.below(6)), to(1 + random.below(20));
        for (BrickRecord &record : above) {
            record.first_node = static_cast<std::uint16_t>(random.below(60));
            record.node_map = random.next() & random.next();
        }
        const Bytes masks_above = bytes(random.below(100)), masks = bytes(1 + random.below(300)),
                    radii = bytes(1 + random.below(3000));
        std::vector<std::uint16_t> normals(radii.size());
        for (std::uint16_t &normal : normals)
            normal = static_cast<std::uint16_t>(random.next());
        const ChunkShape shape{.points = static_cast<std::uint32_t>(normals.size()),
                               .nodes = static_cast<std::uint32_t>(masks.size()),
                               .parents = static_cast<std::uint32_t>(random.below(100)),
                               .bricks = static_cast<std::uint32_t>(to.size())};
        index_bricks({.bricks = above, .masks = masks_above, .first = random.below(80)}, shape, 6, masks, normals,
                     radii, to);
    }
}

TEST(MappedDamage, NoFlippedBitIsMissedByReaderOrValidator) {
    Bytes file = encode(test::sphere_model(2, {.colour = ColourFormat::rgb565}), Storage::mapped);
    test::Random random(3);
    for (std::size_t byte = 0; byte < file.size(); ++byte) {
        const auto flip = static_cast<std::uint8_t>(1U << random.below(8));
        file[byte] ^= flip;
        EXPECT_FALSE(test::read_everything(file)) << byte;
        EXPECT_FALSE(validate(file, {.threads = 1}).valid()) << byte;
        file[byte] ^= flip;
    }
    EXPECT_TRUE(test::read_everything(file));
}

TEST(MappedDamage, PaddingAndBricksAreVerifiedWithoutTheirHashes) {
    const Bytes &good = many_chunks_file();
    const Reader whole = open_with_directories(good);
    for (std::uint32_t level = 1; level <= 5; ++level)
        for (const SectionType type : {SectionType::level_bricks, SectionType::level_chunks}) {
            const SectionEntry &section = *whole.section(type, level);
            const ChunkView first = value_of(whole.view_chunk(static_cast<int>(level), 0));
            // Bricks: every byte of the first record. Chunks: the padding after the masks.
            const std::uint64_t from = type == SectionType::level_bricks ? 0 : first.masks.size();
            const std::uint64_t to = type == SectionType::level_bricks ? kBrickRecordBytes : align_stream(from);
            for (std::uint64_t byte = from; byte < to; ++byte) {
                test::FileEditor editor(good);
                editor.flip(8 * (section.offset + byte) + byte % 8);
                editor.repair();
                const Bytes &file = editor.bytes();
                const Reader reader = open_with_directories(file);
                const Result<ChunkView> view = reader.view_chunk(static_cast<int>(level), 0);
                ASSERT_FALSE(view) << level << ' ' << byte;
                EXPECT_EQ(view.error().message.substr(0, 4), type == SectionType::level_bricks ? "5.11" : "5.10");
                EXPECT_FALSE(reader.view_chunk(5, 0)) << "below a refused chunk";
                EXPECT_FALSE(test::read_everything(file));
                EXPECT_FALSE(validate(file, {.threads = 1}).valid());
            }
        }
}

TEST(MappedDamage, WithRepairedHashesReaderAndValidatorStillAgree) {
    const Bytes good = encode(test::sphere_model(4, {}), Storage::mapped);
    const std::size_t first_level = test::FileEditor(good).section(SectionType::level_directory, 1);
    const int refused =
        test::count_refused(good, 1500, [&](int round) { return round % 2 == 0 ? std::size_t{0} : first_level; });
    EXPECT_GT(refused, 1200);
}

TEST(MappedDamage, AChunkIsVerifiedAtFirstTouchAndOnce) {
    Bytes file = many_chunks_file();
    const Reader reader = open_with_directories(file);
    const std::size_t last = file.size() - 100; // in the last chunk of level 5
    file[last] ^= 1;
    EXPECT_TRUE(reader.view_chunk(5, 0));
    Reader other = value_of(Reader::open(file));
    const std::size_t index = value_of(other.directory(5))->chunks.size() - 1;
    EXPECT_EQ(reader.view_chunk(5, index).error().code, ErrorCode::bad_hash);
    file[last] ^= 1;
    EXPECT_TRUE(reader.view_chunk(5, index));
    file[last] ^= 1;
    EXPECT_TRUE(reader.view_chunk(5, index)) << "was verified before";
}

TEST(MappedStorage, SeveralThreadsMayTouchTheSameChunks) {
    const Reader reader = open_with_directories(many_chunks_file());
    Reader again = value_of(Reader::open(many_chunks_file()));
    const std::size_t chunks = value_of(again.directory(5))->chunks.size();
    std::vector<int> verified(4 * chunks);
    parallel_for(verified.size(), 4,
                 [&](std::size_t i) { verified[i] = reader.view_chunk(5, i % chunks).ok() ? 1 : 0; });
    EXPECT_EQ(std::count(verified.begin(), verified.end(), 1), static_cast<std::ptrdiff_t>(verified.size()));
}

} // namespace
} // namespace pbm
