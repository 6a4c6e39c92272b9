// Single checks of the reader: which call verifies what, parents in directories, and bounds of reads. Out-of-bounds
// reads crash in any build, because the bytes end at a protected page.
#include "pbm_format/container/file_rules.h"
#include "pbm_format/reading/load_model.h"
#include "unit/format/checks_alone.h"

#include "pbm_format/container/section_encoder.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/writing/raster_encoder.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <sys/mman.h>
#include <unistd.h>

namespace pbm {
namespace {

using namespace test;
using enum SectionType;

// A copy of at most one page of bytes that ends at a page without read permission.
class BytesAtTheEnd {
  public:
    explicit BytesAtTheEnd(const Bytes &bytes) : size_(bytes.size()) {
        EXPECT_LE(size_, page_);
        void *pages = ::mmap(nullptr, 2 * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (pages == MAP_FAILED)
            throw std::bad_alloc();
        pages_ = static_cast<std::uint8_t *>(pages);
        EXPECT_EQ(::mprotect(pages_ + page_, page_, PROT_NONE), 0);
        std::copy(bytes.begin(), bytes.end(), pages_ + page_ - size_);
    }
    ~BytesAtTheEnd() { ::munmap(pages_, 2 * page_); }
    BytesAtTheEnd(const BytesAtTheEnd &) = delete;
    BytesAtTheEnd &operator=(const BytesAtTheEnd &) = delete;

    ByteView bytes() const { return {pages_ + page_ - size_, size_}; }
    std::span<const std::uint16_t> normals() const {
        return {reinterpret_cast<const std::uint16_t *>(bytes().data()), size_ / 2};
    }

  private:
    std::size_t page_ = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)), size_;
    std::uint8_t *pages_ = nullptr;
};

TEST(SingleCheck, ABrickReadsNothingBehindItsStreams) {
    const std::array<BrickRecord, 1> above{BrickRecord{.node_map = 0xFF}};
    const Bytes masks_above(8, 0xFF); // the only brick has 64 nodes
    const auto index = [&](std::size_t mask_count, std::size_t points) {
        const BytesAtTheEnd masks(Bytes(mask_count, 0xFF)), normals(Bytes(2 * points, 0)), radii(Bytes(points, 9));
        std::array<BrickRecord, 1> bricks;
        return index_bricks({.bricks = above, .masks = masks_above, .first = 0},
                            {.points = 512, .nodes = 64, .parents = 8, .bricks = 1}, 2, masks.bytes(),
                            normals.normals(), radii.bytes(), bricks);
    };
    EXPECT_TRUE(index(64, 512));
    for (const std::size_t masks : {0U, 8U, 63U})
        EXPECT_FALSE(index(masks, 512)) << masks;
    for (const std::size_t points : {0U, 8U, 511U})
        EXPECT_FALSE(index(64, points)) << points;
}

TEST(SingleCheck, BricksStandInTheOctantsOfTheirParents) {
    struct Case {
        std::uint64_t node_map; // above
        std::size_t first;      // parent
        std::uint32_t parents, bricks;
        std::size_t masks;
        std::uint8_t root_depth = 0;
        MortonCode root_prefix = 0;
    };
    const auto index = [](const Case &of) {
        const std::array<BrickRecord, 1> above{BrickRecord{.node_map = of.node_map}};
        const Bytes masks_above(8, 0x03); // each has two nodes
        const Bytes masks(of.masks, 0x81), radii(2 * of.masks, 9);
        const std::vector<std::uint16_t> normals(2 * of.masks, 0);
        std::vector<BrickRecord> bricks(of.bricks);
        ChunkShape shape{.root_depth = of.root_depth, .root_prefix = of.root_prefix};
        shape.parents = of.parents;
        shape.bricks = of.bricks;
        return index_bricks({.bricks = above, .masks = masks_above, .first = of.first}, shape, 4, masks, normals, radii,
                            bricks);
    };
    // Two octants: the first has two parents, the second one.
    EXPECT_TRUE(index({.node_map = 0x0103, .first = 2, .parents = 1, .bricks = 1, .masks = 2}));
    EXPECT_FALSE(index({.node_map = 0x0103, .first = 1, .parents = 2, .bricks = 1, .masks = 2})); // within the first
    EXPECT_FALSE(index({.node_map = 0x0103, .first = 9, .parents = 1, .bricks = 1, .masks = 2})); // after both
    EXPECT_FALSE(
        index({.node_map = 0x01, .first = 0, .parents = 1, .bricks = 2, .masks = 2})); // more bricks than octants
    // Two bricks lie below the root of the grid, and neither octant alone contains both.
    EXPECT_TRUE(index({.node_map = 0x0101, .first = 0, .parents = 2, .bricks = 2, .masks = 4}));
    for (const MortonCode octant : {0U, 1U})
        EXPECT_FALSE(index({.node_map = 0x0101,
                            .first = 0,
                            .parents = 2,
                            .bricks = 2,
                            .masks = 4,
                            .root_depth = 1,
                            .root_prefix = octant}));
}

TEST(SingleCheck, NoChunkBehindTheLastParentChunk) {
    Directories packed(chunks_file());
    const LevelDirectory &finest = packed.level(5);
    LevelDirectory above = packed.level(4);
    above.chunks.pop_back();
    const auto first = std::find_if(finest.chunks.begin(), finest.chunks.end(), [&](const ChunkEntry &chunk) {
        return chunk.shape.parent_chunk == above.chunks.size();
    });
    ASSERT_NE(first, finest.chunks.end());
    ASSERT_NE(first, finest.chunks.begin());
    const auto index = static_cast<std::size_t>(first - finest.chunks.begin());
    expect_place(decode_directory(encode_directory(finest, packed.set), 5, packed.set,
                                  packed.reader.header().chunk_points, &above, *packed.reader.section(level_chunks, 5)),
                 chunk_entry_bytes(packed.set) * index + 32);
}

// In the last chunk of a parent chunk, `nodes` and `parents` change by one in opposite directions: the check must not
// add them up, but compare each sum with the parent chunk.
TEST(SingleCheck, SumsOverTheChunksOfAParentChunk) {
    Directories packed(chunks_file());
    const LevelDirectory &finest = packed.level(5);
    const std::size_t entry = chunk_entry_bytes(packed.set), last = finest.chunks.size() - 1;
    const ChunkShape &shape = finest.chunks[last].shape;
    for (const std::uint32_t more : {1U, ~0U}) {
        Bytes bytes = encode_directory(finest, packed.set);
        const std::uint32_t nodes = shape.nodes + more, parents = shape.parents - more;
        std::memcpy(bytes.data() + entry * last + 20, &nodes, 4);
        std::memcpy(bytes.data() + entry * last + 24, &parents, 4);
        expect_place(packed.decode_bytes(5, bytes), entry * last + 20);
    }
}

void expect_rule(const Status &status, std::string_view rule, std::uint64_t offset) {
    ASSERT_FALSE(status) << rule;
    EXPECT_EQ(status.error().rule, rule) << status.error().message;
    EXPECT_EQ(status.error().offset, offset) << status.error().message;
}

template <class T> Status status_of(const Result<T> &result) { return result ? Status{} : Status(result.error()); }

TEST(SingleCheck, BricksOfALevelAreCounted) {
    Directories mapped(chunks_file(Storage::mapped));
    const SectionEntry bricks = *mapped.reader.section(level_bricks, 5);
    EXPECT_TRUE(check_brick_count(mapped.level(5), bricks));
    SectionEntry other = bricks;
    ++other.count;
    EXPECT_FALSE(check_brick_count(mapped.level(5), other));
    other = bricks;
    other.element_bytes = 16;
    EXPECT_FALSE(check_brick_count(mapped.level(5), other));
}

TEST(SingleCheck, TheHashOfAMappedChunk) {
    FileEditor file(mapped_file());
    file.flip(8 * (file.chunk(3) + 8));
    file.repair(false);
    const std::uint64_t chunk = file.section(level_chunks, 3);
    expect_rule(read_everything(file.bytes()), "5.6.4", chunk);
    const ValidationReport report = validate(file.bytes(), {.threads = 1});
    EXPECT_EQ(report.findings.at(0).rule, "5.6.4");
    EXPECT_EQ(report.findings.at(0).offset, chunk);
}

TEST(SingleCheck, ATileThatWouldStartBehindItsSection) {
    Bytes section = encode_image(test_image(4, 4, 1), Storage::mapped, 1, 1); // tiles at 128, 192 and 256
    ASSERT_TRUE(decode_image_directory(section, 0));
    section.resize(200);
    expect_rule(status_of(decode_image_directory(section, 0)), "3.10.11", 32 + 2 * 16 + 8);
    EXPECT_FALSE(TiledImage::open(section, 0).ok());
}

const Bytes &shaded_file() {
    static const Bytes file = [] {
        Model model = sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.3);
        add_surroundings(model, 8, 8);
        return value_of(encode_model(model, {.threads = 1}));
    }();
    return file;
}

// No hash is repaired here: each call must verify the hash of the part that it reads.
TEST(SingleCheck, OpenVerifiesTheHashesOfTheSmallSections) {
    for (const SectionType type : {grid, metadata, attributes, materials, lights, texture, ground_plane}) {
        FileEditor file(shaded_file());
        const std::size_t at = file.section(type);
        file.flip(8 * (at + (type == metadata ? 2 : 0))); // a letter of a key
        expect_rule(status_of(Reader::open(file.bytes())), "3.2.14", at);
    }
}

TEST(SingleCheck, TheLevelHashesChecksWhatOpenDoesNotRead) {
    for (const SectionType type : {level_directory, level_chunks}) {
        FileEditor file(shaded_file());
        const std::size_t at = file.section(type, 2);
        file.flip(8 * at);
        ASSERT_TRUE(Reader::open(file.bytes()));
        expect_rule(verify(file.bytes(), {.level = ValidationLevel::hashes}), "3.2.14", at);
    }
}

TEST(SingleCheck, ALoadedModelHasWholeRasters) {
    const std::size_t at = FileEditor(shaded_file()).section(panorama);
    const std::uint64_t size =
        FileEditor(shaded_file()).get<std::uint64_t>(FileEditor(shaded_file()).entry(panorama) + 32);
    // Mip level 0 is stored last; a model does not contain the coarser ones.
    const std::size_t finest =
        at + value_of(decode_image_directory(ByteView(shaded_file()).subspan(at, size), at)).tiles.back().offset;
    const auto load = [&](std::size_t byte) {
        FileEditor file(shaded_file());
        file.flip(8 * byte);
        Reader reader = value_of(Reader::open(file.bytes()));
        return status_of(load_model(reader, {.threads = 1}));
    };
    expect_rule(load(at), "3.10.3", at);
    expect_rule(load(finest), "3.10.12", finest);
}

TEST(SingleCheck, NoRasterIsDecodedThatIsLargerThanTheMemory) {
    FileEditor file(shaded_file());
    const std::size_t at = file.section(panorama);
    const std::size_t first_tile = at + 32 + 16 * file.get<std::uint32_t>(at + 16);
    file.flip(8 * first_tile);
    file.repair(false);
    expect_rule(verify(file.bytes(), {.threads = 1}), "3.10.12", first_tile);
    // The memory limit is checked before decoding finds the damage.
    EXPECT_EQ(verify(file.bytes(), {.threads = 1, .max_memory = 100}).error().code, ErrorCode::memory);
    Reader whole = value_of(Reader::open(shaded_file()));
    EXPECT_EQ(load_model(whole, {.threads = 1, .max_memory = 100}).error().code, ErrorCode::memory);
    EXPECT_EQ(validate(shaded_file(), {.threads = 1, .max_memory = 100}).findings.at(0).code, ErrorCode::memory);
}

TEST(SingleCheck, CallsThatMayNotBeMadeAreRefusedInAnyBuild) {
    const Bytes &packed = shaded_file();
    Reader reader = value_of(Reader::open(packed));
    Chunk to;
    const auto refused = [](const auto &result) { return !result && result.error().code == ErrorCode::usage; };
    EXPECT_TRUE(refused(reader.directory(0)));
    EXPECT_TRUE(refused(reader.directory(reader.depth() + 1)));
    EXPECT_TRUE(refused(reader.load_chunk(1, 0, reader.root_chunk(), to))) << "before its directory";
    EXPECT_EQ(reader.chunk_range(1, 0), FileRange{});
    ASSERT_TRUE(reader.directory(1));
    EXPECT_TRUE(refused(reader.load_chunk(1, 1, reader.root_chunk(), to))) << "level 1 is one chunk";
    EXPECT_TRUE(refused(reader.view_chunk(1, 0))) << "packed";
    EXPECT_TRUE(refused(reader.view_chunk(1, 0, {}, nullptr))) << "packed";
    EXPECT_TRUE(reader.load_chunk(1, 0, reader.root_chunk(), to));

    const Bytes mapped = value_of(encode_model(sphere_model(3, {}), {.storage = Storage::mapped, .threads = 1}));
    Reader viewed = value_of(Reader::open(mapped));
    EXPECT_TRUE(refused(viewed.view_chunk(1, 0))) << "before its directory";
    ASSERT_TRUE(viewed.directory(1));
    EXPECT_TRUE(refused(viewed.load_chunk(1, 0, {}, viewed.root_chunk(), to))) << "mapped";
    EXPECT_TRUE(viewed.view_chunk(1, 0));
}

// rich_file() gets advice: its chunk limit is not the writer's default.
TEST(SingleCheck, AdviceIsForTheDeepLevel) {
    const auto advice = [](ValidationLevel level) {
        const ValidationReport report = validate(rich_file(), {.threads = 1, .level = level, .least = Severity::info});
        EXPECT_TRUE(report.valid());
        return report.warnings + report.infos;
    };
    EXPECT_GT(advice(ValidationLevel::deep), 0U);
    EXPECT_EQ(advice(ValidationLevel::standard), 0U);
}

} // namespace
} // namespace pbm
