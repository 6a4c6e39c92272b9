// Whole files: reading returns what was written, and every damage is found.
#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"

#include "unit/support/file_damage.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace pbm {
namespace {

Bytes encode(const Model &model, const WriteOptions &options = {.compression_level = 3, .threads = 1}) {
    return value_of(encode_model(model, options));
}

Model load(ByteView file) {
    Reader reader = value_of(Reader::open(file));
    return value_of(load_model(reader, {.threads = 1}));
}

const Bytes &small_file() {
    static const Bytes file = encode(test::sphere_model(2, test::every_attribute(ColourFormat::rgb888, 2)));
    return file;
}

TEST(File, EveryAttributeSurvivesTheRoundTrip) {
    for (const ColourFormat colour : {ColourFormat::none, ColourFormat::rgb565, ColourFormat::rgb888})
        for (const int depth : {2, 3, 5, 6}) {
            const Model model = test::sphere_model(depth, test::every_attribute(colour, depth));
            const Bytes file = encode(model, {.compression_level = 3, .chunk_points = 512, .threads = 1});
            EXPECT_EQ(load(file), model);
            EXPECT_TRUE(test::read_everything(file)) << test::read_everything(file).error().message;
            EXPECT_TRUE(validate(file, {.threads = 1}).valid());
        }
}

TEST(File, TheSmallestSetOfAttributesSurvivesTheRoundTrip) {
    const Model model = test::sphere_model(4, {});
    EXPECT_EQ(load(encode(model)), model);
}

TEST(File, AClosedSurfaceIsOneBitOfTheHeader) {
    Model model = test::sphere_model(4, {});
    const Bytes open = encode(model);
    model.parameters.closed = true;
    const Bytes closed = encode(model);
    EXPECT_EQ(load(closed), model);
    EXPECT_EQ(decode_header(open)->minor, 0);
    EXPECT_EQ(decode_header(closed)->minor, 2);
    EXPECT_EQ(decode_header(closed)->optional_features, kClosedFeature);
    EXPECT_EQ(decode_header(closed)->content_id, decode_header(open)->content_id);
    ASSERT_EQ(closed.size(), open.size());
    for (std::size_t i = 0; i < open.size(); ++i) // minor version, bit, hash of the header
        EXPECT_TRUE(closed[i] == open[i] || i == 10 || i == 48 || (i >= 120 && i < 128)) << i;
    const ValidationReport report = validate(closed, {.least = Severity::info});
    EXPECT_TRUE(report.findings.empty());
}

TEST(File, ShapesAreASectionThatEarlierReadersIgnore) {
    Model model = test::sphere_model(4, {});
    const Bytes discs = encode(model);
    model.parameters.materials[0].shape = PointShape::round;
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes round = encode(model, {.storage = storage});
        EXPECT_EQ(load(round), model);
        EXPECT_EQ(decode_header(round)->minor, 3);
        EXPECT_EQ(decode_header(round)->content_id, decode_header(discs)->content_id);
        const auto sections = decode_section_table(round, *decode_header(round));
        ASSERT_TRUE(sections);
        const SectionEntry *const shapes = find_section(*sections, SectionType::shapes);
        ASSERT_NE(shapes, nullptr);
        EXPECT_EQ(shapes->flags, 0);
        EXPECT_EQ(shapes->raw_bytes, 8U);
        EXPECT_TRUE(validate(round, {.least = Severity::info}).findings.empty());
    }
    EXPECT_EQ(decode_header(discs)->minor, 0);
}

TEST(File, TintsAreBytesOfRecordsOfShapes) {
    Model model = test::sphere_model(4, {});
    const Bytes plain = encode(model);
    model.parameters.materials[0].tint = 200;
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes tinted = encode(model, {.storage = storage});
        EXPECT_EQ(load(tinted), model);
        EXPECT_EQ(decode_header(tinted)->minor, 5);
        EXPECT_EQ(decode_header(tinted)->content_id, decode_header(plain)->content_id);
        EXPECT_TRUE(validate(tinted, {.least = Severity::info}).findings.empty());
        // Written by a version that knew no tints, it is as valid.
        test::FileEditor editor(tinted);
        editor.set<std::uint16_t>(10, 3);
        editor.repair();
        EXPECT_EQ(load(editor.bytes()), model);
        EXPECT_TRUE(validate(editor.bytes(), {.least = Severity::info}).findings.empty());
    }
}

TEST(File, AShapeOfALaterVersionIsADisc) {
    const std::vector<Material> two(2);
    EXPECT_EQ(value_of(decode_shapes(Bytes{2, 9, 9, 9, 9, 9, 9, 9, 1, 0, 0, 0, 0, 0, 0, 0}, two))[0].shape,
              PointShape::disc);
    EXPECT_EQ(value_of(decode_shapes(Bytes{2, 9, 9, 9, 9, 9, 9, 9, 1, 0, 0, 0, 0, 0, 0, 0}, two))[1].shape,
              PointShape::round);
    EXPECT_EQ(value_of(decode_shapes(Bytes{2, 9, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, two))[0].tint, 9);
    EXPECT_EQ(decode_shapes(Bytes(15), two).error().code, ErrorCode::bad_section);
}

TEST(File, BytesDependOnNeitherThreadsNorTheMachine) {
    const Model model = test::sphere_model(6, test::every_attribute(ColourFormat::rgb888, 6));
    const Bytes one = encode(model, {.chunk_points = 512, .threads = 1});
    EXPECT_EQ(one, encode(model, {.chunk_points = 512, .threads = 8}));
}

TEST(File, ContentIdIgnoresTheCodecAndSeesEveryPoint) {
    Model model = test::sphere_model(4, test::every_attribute(ColourFormat::rgb888, 4));
    const auto id = [](const Bytes &file) { return value_of(Reader::open(file)).header().content_id; };
    const ContentId first = id(encode(model, {.compression_level = 1}));
    EXPECT_EQ(first, id(encode(model, {.compression_level = 19})));
    model.metadata = R"({"name":"other"})";
    EXPECT_EQ(first, id(encode(model)));
    model.levels.back().points.colours[7] ^= 1;
    average_levels(model, 1);
    EXPECT_NE(first, id(encode(model)));
}

TEST(File, ChunksLoadOneByOne) {
    const Model model = test::sphere_model(6, test::every_attribute(ColourFormat::rgb565, 6));
    const Bytes file = encode(model, {.chunk_points = 512, .threads = 1});
    Reader reader = value_of(Reader::open(file));
    const LevelDirectory &directory = **reader.directory(6);
    ASSERT_GT(directory.chunks.size(), 10U);
    std::vector<std::vector<Chunk>> levels(7);
    levels[0].push_back(reader.root_chunk());
    for (int level = 1; level <= 6; ++level) {
        const auto at = static_cast<std::size_t>(level);
        const std::vector<ChunkEntry> &entries = value_of(reader.directory(level))->chunks;
        levels[at].resize(entries.size());
        for (std::size_t i = 0; i < entries.size(); ++i)
            ASSERT_TRUE(reader.load_chunk(level, i, levels[at - 1][entries[i].shape.parent_chunk], levels[at][i]).ok());
    }
    for (std::size_t i = 0; i < directory.chunks.size(); ++i) {
        const Chunk &chunk = levels[6][i];
        const ChunkEntry &entry = directory.chunks[i];
        EXPECT_LE(entry.shape.points, 512U);
        EXPECT_TRUE(std::equal(chunk.masks.begin(), chunk.masks.end(),
                               model.levels[6].masks.begin() + static_cast<std::ptrdiff_t>(entry.first_node)));
        EXPECT_TRUE(
            std::equal(chunk.points.normals.begin(), chunk.points.normals.end(),
                       model.levels[6].points.normals.begin() + static_cast<std::ptrdiff_t>(entry.first_point)));
    }
}

TEST(File, ACoarseLevelLoadsWithoutTheFinerOnes) {
    const Model model = test::sphere_model(6, test::every_attribute(ColourFormat::rgb888, 6));
    Bytes file = encode(model);
    Reader reader = value_of(Reader::open(file));
    file[file.size() - 1] ^= 0xFF; // damages the finest level, which is not loaded
    const Model coarse = value_of(load_model(reader, {.max_level = 4, .threads = 1}));
    ASSERT_EQ(coarse.levels.size(), 5U);
    EXPECT_EQ(coarse.levels[4], model.levels[4]);
    EXPECT_FALSE(load_model(reader, {.max_level = 6, .threads = 1}));
}

TEST(File, ALevelThatNeedsMoreMemoryThanAllowedIsRefused) {
    const Bytes file = encode(test::sphere_model(6, {}));
    Reader reader = value_of(Reader::open(file));
    const Result<Model> model = load_model(reader, {.threads = 1, .max_memory = 10000});
    ASSERT_FALSE(model);
    EXPECT_EQ(model.error().code, ErrorCode::memory);
}

TEST(Damage, EveryTruncationIsRefusedWithItsPlace) {
    const Bytes &file = small_file();
    for (std::size_t size = 0; size < file.size(); ++size) {
        const ByteView cut(file.data(), size);
        const Status status = test::read_everything(cut);
        ASSERT_FALSE(status) << size;
        EXPECT_EQ(status.error().code, size == 0 ? ErrorCode::not_bvg : ErrorCode::truncated) << size;
        EXPECT_EQ(status.error().offset, size);
        EXPECT_FALSE(validate(cut, {.threads = 1}).valid()) << size;
    }
}

TEST(Damage, EveryFlippedBitIsRefusedByReaderAndValidator) {
    Bytes file = small_file();
    for (std::size_t bit = 0; bit < 8 * file.size(); ++bit) {
        file[bit / 8] = static_cast<std::uint8_t>(file[bit / 8] ^ 1U << bit % 8);
        const Status status = test::read_everything(file);
        const ValidationReport report = validate(file, {.threads = 1});
        ASSERT_FALSE(status) << "bit " << bit;
        ASSERT_FALSE(report.valid()) << "bit " << bit;
        EXPECT_EQ(exit_code(status.error().code), 3) << "bit " << bit;
        EXPECT_LE(status.error().offset, bit / 8) << "bit " << bit; // start of the damaged part, or its stored hash
        file[bit / 8] = static_cast<std::uint8_t>(file[bit / 8] ^ 1U << bit % 8);
    }
    EXPECT_TRUE(test::read_everything(file));
}

TEST(Damage, WithRepairedHashesReaderAndValidatorStillAgree) {
    const Model model = test::sphere_model(3, test::every_attribute(ColourFormat::rgb565, 3));
    const Bytes good = encode(model);
    const int refused = test::count_refused(good, 4000, [](int) { return std::size_t{0}; });
    EXPECT_GT(refused, 3500); // metadata and some parameters have no rule
}

TEST(Damage, AForeignFileIsNamedAsWhatItIs) {
    const auto message = [](std::string_view text) {
        const Bytes bytes(text.begin(), text.end());
        return Reader::open(bytes).error().message;
    };
    EXPECT_NE(message("P4\n8 8\n").find("Netpbm bitmap"), std::string::npos);
    EXPECT_NE(message("P1 8 8").find("Netpbm bitmap"), std::string::npos);
    EXPECT_NE(message("ply\nformat ascii 1.0\n").find("pbm-build"), std::string::npos);
    EXPECT_NE(message("").find("empty"), std::string::npos);
    EXPECT_NE(message("\x89"
                      "BVG\n\x1A\n and so on")
                  .find("text-mode"),
              std::string::npos);
}

TEST(Damage, ANewerVersionAndUnknownFeaturesAreUnsupportedNotInvalid) {
    const auto edited = [](std::size_t at, std::uint8_t value = 1) {
        test::FileEditor editor(small_file());
        editor.set<std::uint8_t>(at, value);
        editor.repair();
        return editor.bytes();
    };
    EXPECT_EQ(test::read_everything(edited(8, 2)).error().code, ErrorCode::unsupported_version);
    EXPECT_EQ(test::read_everything(edited(40, 2)).error().code, ErrorCode::unsupported_feature);
    EXPECT_TRUE(test::read_everything(edited(48))); // an unknown optional feature is ignored
}

class ReplaceFile : public testing::Test {
  protected:
    ReplaceFile() {
        folder_ = std::filesystem::path(testing::TempDir()) /
                  ("pbm_replace_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    ~ReplaceFile() override { std::filesystem::remove_all(folder_); }

    std::string content(const std::string &name) const {
        std::ifstream in(folder_ / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::filesystem::path folder_;
};

TEST_F(ReplaceFile, ReplacesTheWholeFileAndLeavesNothingBeside) {
    const std::string path = (folder_ / "a.pbvg").string();
    for (const Durability durability : {Durability::synced, Durability::cached}) {
        std::ofstream(path) << "the old content, which is longer";
        const Bytes bytes{'n', 'e', 'w'};
        ASSERT_TRUE(replace_file(path, bytes, durability));
        EXPECT_EQ(content("a.pbvg"), "new");
        EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
    }
}

TEST_F(ReplaceFile, FollowsALinkToTheFileItNames) {
    std::ofstream(folder_ / "real") << "old";
    std::filesystem::create_symlink("real", folder_ / "link");
    const Bytes bytes{'n', 'e', 'w'};
    ASSERT_TRUE(replace_file((folder_ / "link").string(), bytes));
    EXPECT_EQ(content("real"), "new");
    EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "link"));
}

TEST_F(ReplaceFile, RefusesFoldersAndMissingFolders) {
    const Bytes bytes{'n'};
    EXPECT_EQ(replace_file(folder_.string(), bytes).error().code, ErrorCode::io);
    EXPECT_EQ(replace_file((folder_ / "no" / "where").string(), bytes).error().code, ErrorCode::io);
}

TEST(MappedFile, RefusesAllButRegularFiles) {
    EXPECT_EQ(MappedFile::open("/dev/null").error().code, ErrorCode::io);
    EXPECT_EQ(MappedFile::open("/").error().code, ErrorCode::io);
    EXPECT_EQ(MappedFile::open("/no/such/file").error().code, ErrorCode::io);
}

} // namespace
} // namespace pbm
