// Checks that format_spec/vectors does not cover one by one: both sides of bounds, fields with several faults, and
// faults that a hash or an earlier rule hides in a whole file.
#include "pbm_format/container/section_encoder.h"
#include "unit/format/checks_alone.h"

#include <gtest/gtest.h>

#include <limits>

namespace pbm {
namespace {

using namespace test;
using enum SectionType;

TEST(SingleCheck, BoundsOfTheHeader) {
    expect_refusal(rich_file(), set<std::uint32_t>(104, 131072), ErrorCode::bad_header, 104);
    expect_refusal(rich_file(), set<std::uint64_t>(56, std::uint64_t{1} << 33), ErrorCode::bad_header, 56);
    EXPECT_EQ(Reader::open({}).error().code, ErrorCode::not_bvg);
    EXPECT_EQ(Reader::open(ByteView(rich_file()).first(5)).error().code, ErrorCode::truncated);
}

TEST(SingleCheck, FieldsOfTheTable) {
    const FileEditor file(rich_file());
    const auto field = [&](SectionType type, std::uint32_t instance, std::size_t at) {
        return file.entry(type, instance) + at;
    };
    // Level instances 0 and depth + 1: the table would still be in order.
    const std::size_t first = field(level_directory, 1, 8), last = field(level_chunks, 3, 8);
    expect_refusal(rich_file(), set<std::uint32_t>(first, 0), ErrorCode::bad_table, first);
    expect_refusal(rich_file(), set<std::uint32_t>(last, 4), ErrorCode::bad_table, last);
    for (const std::uint32_t alignment : {0U, 4U, 12U, 131072U}) {
        const std::size_t at = field(metadata, 0, 16);
        expect_refusal(rich_file(), set<std::uint32_t>(at, alignment), ErrorCode::bad_table, at);
    }
    const std::size_t element = field(grid, 0, 12);
    for (const std::uint32_t bytes : {0U, 5U, 96U})
        expect_refusal(rich_file(), set<std::uint32_t>(element, bytes), ErrorCode::bad_table, element);
    // 48 / 5 rounds down to 9 = count, but 5 x 9 = 45 is not 48 bytes.
    expect_refusal(
        rich_file(),
        [&](FileEditor &editor) {
            editor.set<std::uint32_t>(element, 5);
            editor.set<std::uint64_t>(element + 36, 9);
        },
        ErrorCode::bad_table, element);
    const std::size_t offset = field(metadata, 0, 24);
    expect_refusal(rich_file(), set<std::uint64_t>(offset, ~std::uint64_t{7}), ErrorCode::bad_table, offset);
}

TEST(SingleCheck, ASectionFarOutsideTheFile) {
    // An alignment of 65,536 puts the last section behind the end of the file.
    FileEditor editor(rich_file());
    const std::size_t at = editor.entry(level_chunks, 3);
    editor.set<std::uint32_t>(at + 16, 65536);
    editor.set<std::uint64_t>(at + 24, 65536);
    ASSERT_LT(editor.bytes().size(), 65536U);
    editor.repair();
    EXPECT_EQ(test::read_everything(editor.bytes()).error().code, ErrorCode::truncated);
    EXPECT_EQ(validate(editor.bytes(), {.threads = 1}).findings[0].code, ErrorCode::truncated);
}

TEST(SingleCheck, BytesBehindTheLastSection) {
    expect_refusal(
        rich_file(),
        [](FileEditor &file) {
            file.bytes().resize(file.bytes().size() + 8, 0);
            file.set<std::uint64_t>(16, file.bytes().size());
        },
        ErrorCode::bad_table, rich_file().size());
}

TEST(SingleCheck, RawSizesThatOverflow) {
    // A sum of raw sizes cannot overflow: rule 3.2.10 bounds the raw size of each section by its stored size, and
    // refuses 2^64 - 1.
    FileEditor editor(rich_file());
    const std::size_t at = editor.entry(level_chunks, 3);
    editor.set<std::uint64_t>(at + 40, ~std::uint64_t{0});
    editor.repair();
    EXPECT_EQ(test::read_everything(editor.bytes()).error().code, ErrorCode::too_large);
}

TEST(SingleCheck, ALevelNeedsChunksAndADirectory) {
    for (const SectionType type : {level_directory, level_chunks}) {
        FileEditor editor(rich_file());
        const std::size_t count = editor.get<std::uint32_t>(32), at = editor.entry(type, 1);
        const std::size_t end = kHeaderBytes + kSectionEntryBytes * count;
        // Removes the section's table entry and its bytes, and moves the sections that follow.
        Bytes &bytes = editor.bytes();
        const std::uint64_t stored = editor.get<std::uint64_t>(at + 32), offset = editor.get<std::uint64_t>(at + 24);
        const std::uint64_t next = at + kSectionEntryBytes < end ? editor.get<std::uint64_t>(at + 64 + 24) : 0;
        const std::uint64_t removed = next - offset;
        ASSERT_EQ(removed % 8, 0U);
        ASSERT_GE(removed, stored);
        const std::uint64_t raw = editor.get<std::uint64_t>(at + 40);
        bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(offset),
                    bytes.begin() + static_cast<std::ptrdiff_t>(next));
        bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    bytes.begin() + static_cast<std::ptrdiff_t>(at + kSectionEntryBytes));
        for (std::size_t entry = kHeaderBytes; entry < end - kSectionEntryBytes; entry += kSectionEntryBytes)
            editor.set<std::uint64_t>(entry + 24, editor.get<std::uint64_t>(entry + 24) - kSectionEntryBytes -
                                                      (entry >= at ? removed : 0));
        editor.set<std::uint32_t>(32, static_cast<std::uint32_t>(count - 1));
        editor.set<std::uint64_t>(64, editor.get<std::uint64_t>(64) - raw);
        editor.set<std::uint64_t>(16, bytes.size());
        editor.repair();
        const Status status = test::read_everything(bytes);
        ASSERT_FALSE(status);
        EXPECT_EQ(status.error().code, ErrorCode::bad_table) << status.error().message;
        EXPECT_EQ(status.error().offset, kHeaderBytes) << status.error().message;
    }
}

TEST(SingleCheck, BoundsOfTheGrid) {
    const std::size_t at = FileEditor(rich_file()).section(grid);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    expect_refusal(rich_file(), set<double>(at, kInfinity), ErrorCode::bad_section, at);
    expect_refusal(rich_file(), set<double>(at + 16, -kInfinity), ErrorCode::bad_section, at + 16);
    // Both values are finite, but their sum is not.
    expect_refusal(
        rich_file(),
        [=](FileEditor &file) {
            file.set<double>(at + 8, std::numeric_limits<double>::max());
            file.set<double>(at + 24, 1e307);
        },
        ErrorCode::bad_section, at + 8);
    for (const double size : {-1.0, 1e-310, 0.0})
        expect_refusal(rich_file(), set<double>(at + 24, size), ErrorCode::bad_section, at + 24);
}

TEST(SingleCheck, RecordsOfAttributes) {
    const std::size_t at = FileEditor(rich_file()).section(attributes);
    const auto field = [&](std::size_t record, std::size_t offset) { return at + 24 * record + offset; };
    expect_refusal(rich_file(), set<std::uint8_t>(field(0, 0), 0), ErrorCode::unsupported_feature, field(0, 0));
    expect_refusal(rich_file(), set<std::uint8_t>(field(2, 1), 0), ErrorCode::unsupported_feature, field(2, 1));
    expect_refusal(rich_file(), set<std::uint8_t>(field(1, 1), 1), ErrorCode::unsupported_feature, field(1, 1));
    expect_refusal(rich_file(), set<std::uint8_t>(field(1, 2), 1), ErrorCode::bad_section, field(1, 0)); // a light
    expect_refusal(rich_file(), set<std::uint8_t>(field(5, 4), 16), ErrorCode::bad_section,
                   field(5, 4)); // bits per value
    // A shadow stream in front of the texture values.
    Bytes records = encode_attributes(every_attribute(ColourFormat::rgb888, 3), 3);
    std::swap_ranges(records.begin() + 96, records.begin() + 120, records.begin() + 120);
    EXPECT_EQ(decode_attributes(records, 3).error().code, ErrorCode::bad_section);
    EXPECT_EQ(decode_attributes(records, 3).error().offset, 120U);
    // Nine shadow streams.
    AttributeSet nine{.lights = kMaxLights};
    for (auto &bits : nine.shadow_bits)
        std::fill_n(bits.begin(), 4, std::uint8_t{1});
    records = encode_attributes(nine, 3);
    EXPECT_TRUE(decode_attributes(records, 3).ok());
    const Bytes last(records.end() - 24, records.end());
    records.insert(records.end(), last.begin(), last.end());
    records[records.size() - 22] = kMaxLights;
    EXPECT_EQ(decode_attributes(records, 3).error().code, ErrorCode::bad_section);
    EXPECT_EQ(decode_attributes({}, 3).error().code, ErrorCode::bad_section);
}

TEST(SingleCheck, NumbersOfMaterialsAndLights) {
    EXPECT_FALSE(decode_materials({}));
    EXPECT_FALSE(decode_lights({}));
    EXPECT_TRUE(decode_materials(encode_materials(std::vector<Material>(kMaxMaterials))));
    EXPECT_FALSE(decode_materials(encode_materials(std::vector<Material>(kMaxMaterials + 1))));
    EXPECT_TRUE(decode_lights(encode_lights(std::vector<Light>(kMaxLights))));
    EXPECT_FALSE(decode_lights(encode_lights(std::vector<Light>(kMaxLights + 1))));
}

TEST(SingleCheck, BoundsOfMaterialsLightsAndTextures) {
    const auto refuses_material = [](auto &&change) {
        Material material;
        change(material);
        return !decode_materials(encode_materials({&material, 1}));
    };
    EXPECT_FALSE(refuses_material([](Material &) {}));
    for (float Material::*coefficient : {&Material::ka, &Material::kd, &Material::ks, &Material::environment})
        for (const float value : {-0.1F, 1.1F, std::numeric_limits<float>::quiet_NaN()})
            EXPECT_TRUE(refuses_material([&](Material &material) { material.*coefficient = value; }));
    for (const float power : {0.0F, 1025.0F})
        EXPECT_TRUE(refuses_material([&](Material &material) { material.power = power; }));
    const auto refuses_light = [](auto &&change) {
        Light light;
        change(light);
        return !decode_lights(encode_lights({&light, 1}));
    };
    EXPECT_FALSE(refuses_light([](Light &) {}));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_TRUE(refuses_light([&](Light &light) { light.intensity[axis] = 2e6F; }));
        EXPECT_TRUE(
            refuses_light([&](Light &light) { light.position[axis] = std::numeric_limits<float>::infinity(); }));
    }
    EXPECT_TRUE(refuses_light([](Light &light) { light.direction = {0, 0, 0.9F}; }));
    EXPECT_TRUE(refuses_light([](Light &light) { light.exponent = -1; }));
    const auto refuses_texture = [](auto &&change) {
        SolidTexture texture;
        change(texture);
        return !decode_texture(encode_texture(texture));
    };
    EXPECT_FALSE(refuses_texture([](SolidTexture &) {}));
    EXPECT_TRUE(refuses_texture([](SolidTexture &texture) { texture.scale = 2e9F; }));
    EXPECT_TRUE(refuses_texture([](SolidTexture &texture) { texture.turbulence = 2e6F; }));
    EXPECT_TRUE(refuses_texture([](SolidTexture &texture) { texture.kind = TextureKind{0}; }));
}

TEST(SingleCheck, TheEdgeOfTheGroundPlane) {
    for (const float edge : {-1.0F, 1e-40F, std::numeric_limits<float>::infinity()})
        EXPECT_FALSE(decode_ground_plane(encode_ground_plane({.half_edge = edge, .texture = {}})));
    EXPECT_TRUE(decode_ground_plane(encode_ground_plane({.half_edge = 1e-30F, .texture = {}})));
}

Status metadata_of(const std::string &text) {
    return check_metadata({reinterpret_cast<const std::uint8_t *>(text.data()), text.size()});
}

TEST(SingleCheck, LengthAndNestingOfMetadata) {
    EXPECT_TRUE(metadata_of("{}" + std::string(4094, ' ')));
    EXPECT_FALSE(metadata_of("{}" + std::string(4095, ' ')));
    const auto nested = [](std::size_t depth) {
        return R"({"a":)" + std::string(depth - 1, '[') + std::string(depth - 1, ']') + "}";
    };
    EXPECT_TRUE(metadata_of(nested(32)));
    EXPECT_FALSE(metadata_of(nested(33)));
    EXPECT_FALSE(metadata_of("\xEF\xBB\xBF{}"));
}

TEST(SingleCheck, CountsOfAChunk) {
    Directories packed(chunks_file());
    const ChunkShape shape = packed.level(5).chunks[0].shape;
    EXPECT_TRUE(packed.decode(5, 0, 16, shape.points).ok());
    expect_place(packed.decode<std::uint32_t>(5, 0, 16, 0), 16);
    expect_place(packed.decode<std::uint32_t>(5, 0, 16, 513), 16);
    expect_place(packed.decode<std::uint32_t>(5, 0, 20, 0), 20);
    expect_place(packed.decode<std::uint32_t>(5, 0, 20, shape.points + 1), 20);
    expect_place(packed.decode<std::uint32_t>(5, 0, 20, (shape.points - 1) / 8), 20);
    expect_place(packed.decode<std::uint32_t>(5, 0, 24, shape.nodes + 1), 24);
    expect_place(packed.decode<std::uint32_t>(5, 0, 24, (shape.nodes - 1) / 8), 24);
    expect_place(packed.decode<std::uint32_t>(5, 0, 28, shape.parents + 1), 28);
    expect_place(packed.decode<std::uint32_t>(5, 0, 28, (shape.parents - 1) / 8), 28);
    expect_place(packed.decode<std::uint32_t>(1, 0, 20, 2), 20 + 4); // level 0 would have two nodes
    expect_place(packed.decode<std::uint32_t>(1, 0, 24, 1), 24);
    expect_place(packed.decode<std::uint32_t>(1, 0, 28, 2), 28);
    expect_place(packed.decode<std::uint32_t>(2, 0, 28, 2), 28);
    expect_place(packed.decode<std::uint32_t>(2, 0, 24, 2), 28); // level 0 would have two parents
    expect_place(packed.decode_bytes(5, {}), 0);
}

TEST(SingleCheck, TheConeOfAChunk) {
    Directories packed(chunks_file());
    expect_place(packed.decode<std::uint16_t>(5, 0, 36, kNormalCount), 36);
    expect_place(packed.decode<std::int16_t>(5, 0, 38, -32768), 36);
    expect_place(packed.decode<std::uint32_t>(5, 0, 36, 0x80010001), 36); // "no cone" with a non-zero axis
}

TEST(SingleCheck, PlacesOfChunks) {
    Directories packed(chunks_file());
    const LevelDirectory &finest = packed.level(5);
    const std::size_t entry = chunk_entry_bytes(packed.set), last = finest.chunks.size() - 1;
    ASSERT_GE(finest.chunks.size(), 3U);
    // Level 1 is one chunk without parent.
    expect_place(packed.decode<std::uint32_t>(1, 0, 32, 1), 32);
    Bytes twice = encode_directory(packed.level(1), packed.set);
    const Bytes one = twice;
    twice.insert(twice.end(), one.begin(), one.end());
    expect_place(packed.decode_bytes(1, twice), entry);
    // Without the last chunk, points of the last parent chunk have no masks.
    const Bytes all = encode_directory(finest, packed.set);
    expect_place(packed.decode_bytes(5, ByteView(all).first(entry * last)), entry * last);
    expect_place(packed.decode<std::uint32_t>(5, last, 32, 1000), entry * last + 32);
    // A root depth of 0 makes the chunk's root larger than that of its parent chunk.
    for (std::size_t i = 0; i <= last; ++i) {
        const ChunkShape &shape = finest.chunks[i].shape;
        const ChunkShape &parent = packed.level(4).chunks[shape.parent_chunk].shape;
        if (parent.root_depth == 0)
            continue;
        expect_place(packed.decode<std::uint8_t>(5, i, 40, 0), entry * i);
        return;
    }
}

// Each count is possible by itself, but the counts disagree with those of the parent chunk.
TEST(SingleCheck, ChunksThatHoldMoreThanTheirParent) {
    Directories packed(chunks_file());
    const LevelDirectory &finest = packed.level(5);
    const std::size_t entry = chunk_entry_bytes(packed.set);
    for (std::size_t i = 0; i + 1 < finest.chunks.size(); ++i) {
        const ChunkShape &shape = finest.chunks[i].shape;
        const ChunkShape &next = finest.chunks[i + 1].shape;
        const ChunkShape &parent = packed.level(4).chunks[shape.parent_chunk].shape;
        if (shape.nodes + 1 > shape.points || shape.nodes + 1 > 8 * shape.parents)
            continue;
        const bool fills = shape.parent_chunk != next.parent_chunk && shape.nodes == parent.points;
        if (!fills)
            continue;
        // One node more than the parent chunk has points.
        Bytes bytes = encode_directory(finest, packed.set);
        const std::uint32_t nodes = shape.nodes + 1;
        std::memcpy(bytes.data() + entry * i + 20, &nodes, 4);
        expect_place(packed.decode_bytes(5, bytes), entry * i + 20);
        // `parents` differs by one from the nodes of the parent chunk.
        const std::uint32_t parents = shape.parents - 1;
        bytes = encode_directory(finest, packed.set);
        if (parents * 8 < shape.nodes || parents < shape.bricks)
            continue;
        std::memcpy(bytes.data() + entry * i + 24, &parents, 4);
        expect_place(packed.decode_bytes(5, bytes), entry * i + 20);
        const std::uint32_t more = shape.parents + 1;
        bytes = encode_directory(finest, packed.set);
        std::memcpy(bytes.data() + entry * i + 24, &more, 4);
        expect_place(packed.decode_bytes(5, bytes), entry * i + 20);
        return;
    }
}

TEST(SingleCheck, SizesOfStreams) {
    Directories packed(chunks_file());
    const ChunkEntry &chunk = packed.level(5).chunks[0];
    const std::uint32_t points = chunk.shape.points, nodes = chunk.shape.nodes;
    const std::size_t masks = kChunkEntryFixedBytes, normals = masks + 4, radii = masks + 8;
    constexpr std::uint32_t kZstd = 1U << 31;
    const auto filtered = [](Filter filter) { return static_cast<std::uint32_t>(filter) << 24; };
    const auto refused = [&](std::size_t field, std::uint32_t value) {
        expect_place(packed.decode<std::uint32_t>(5, 0, field, value), field);
    };
    refused(masks, nodes + 1);                       // raw, but the size is wrong
    refused(masks, kZstd);                           // an empty frame
    refused(normals, (2 * points) | kZstd);          // a frame no smaller than its raw size
    refused(masks, filtered(Filter::mask_rank) | 3); // too short for the planes' size fields
    refused(normals, filtered(Filter::normal) | 7);
    refused(radii, filtered(Filter::radius) | points); // no smaller than unfiltered
    refused(radii,
            filtered(Filter::radius) | kZstd | (points - 1)); // the zstd flag belongs to the planes
    expect_place(packed.decode<std::uint32_t>(5, 0, radii, filtered(Filter::normal) | 20), radii,
                 ErrorCode::unsupported_feature);
    // One byte more than is left of the section.
    const std::size_t last = packed.level(5).chunks.size() - 1, entry = chunk_entry_bytes(packed.set);
    const auto stored = packed.level(5).chunks[last].streams;
    ASSERT_NE(stored[1].filter, Filter::none);
    expect_place(
        packed.decode<std::uint32_t>(5, last, normals, filtered(stored[1].filter) | (stored[1].stored_bytes + 1)),
        entry * last + kChunkEntryFixedBytes);
    // One byte less: only the sum over the section shows it.
    expect_place(
        packed.decode<std::uint32_t>(5, last, normals, filtered(stored[1].filter) | (stored[1].stored_bytes - 1)),
        entry * (last + 1));
}

TEST(SingleCheck, StreamsOfAMappedFileAreRaw) {
    Directories mapped(chunks_file(Storage::mapped));
    const ChunkEntry &chunk = mapped.level(5).chunks[0];
    const std::uint32_t filter = static_cast<std::uint32_t>(Filter::radius) << 24;
    expect_place(mapped.decode<std::uint32_t>(5, 0, kChunkEntryFixedBytes + 8, filter | (chunk.shape.points - 1)),
                 kChunkEntryFixedBytes);
    expect_place(mapped.decode<std::uint32_t>(5, 0, kChunkEntryFixedBytes + 8, 1U << 31 | (chunk.shape.points - 1)),
                 kChunkEntryFixedBytes);
}

TEST(SingleCheck, TheTableCountsTheChunksAndPointsOfADirectory) {
    // Twice as many records of half the size: the table entry agrees with itself.
    const FileEditor file(chunks_file());
    const std::size_t at = file.entry(level_directory, 5);
    const auto size = file.get<std::uint32_t>(at + 12);
    expect_refusal(
        chunks_file(),
        [=](FileEditor &editor) {
            editor.set<std::uint32_t>(at + 12, size / 2);
            editor.set<std::uint64_t>(at + 48, 2 * editor.get<std::uint64_t>(at + 48));
        },
        ErrorCode::bad_directory, at + 48);
    const std::size_t points = file.entry(level_chunks, 3) + 48;
    const std::uint64_t end =
        file.section(level_directory, 3) + file.get<std::uint64_t>(file.entry(level_directory, 3) + 32);
    expect_refusal(chunks_file(), set<std::uint64_t>(points, file.get<std::uint64_t>(points) + 1),
                   ErrorCode::bad_directory, end);
}

} // namespace
} // namespace pbm
