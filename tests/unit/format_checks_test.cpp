// Checks that the files of format_spec/vectors do not try one by one: bounds on both sides, fields that are wrong in
// more than one way, and what the hashes or an earlier rule hide in a whole file.
#include "file_damage.h"
#include "file_editor.h"
#include "test_models.h"

#include "pbm_format/chunk.h"
#include "pbm_format/frame.h"
#include "pbm_format/image_section.h"
#include "pbm_format/mapped_chunk.h"
#include "pbm_format/platform.h"
#include "pbm_format/stream_rules.h"
#include "pbm_format/tiled_image.h"
#include "pbm_format/writer.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace pbm {
namespace {

using test::every_attribute;
using test::FileEditor;
using test::sphere_model;
using Edit = std::function<void(FileEditor &)>;
using enum SectionType;

const Bytes &rich_file() {
    static const Bytes file =
        encode_model(sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.3),
                     {.compression_level = 19, .filters = false, .chunk_points = 512, .threads = 1})
            .value();
    return file;
}

// Several chunks at levels 4 and 5.
const Bytes &chunks_file(Storage storage = Storage::packed) {
    static const Bytes packed = encode_model(sphere_model(5, {}), {.chunk_points = 512, .threads = 1}).value();
    static const Bytes mapped =
        encode_model(sphere_model(5, {}), {.storage = Storage::mapped, .chunk_points = 512, .threads = 1}).value();
    return storage == Storage::packed ? packed : mapped;
}

const Bytes &mapped_file() {
    static const Bytes file = encode_model(sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.3),
                                           {.storage = Storage::mapped, .chunk_points = 512, .threads = 1})
                                  .value();
    return file;
}

// What reader and validator say of an edited and signed file; they must name the same kind of fault at the same place.
Status verdict(const Bytes &good, const Edit &edit) {
    FileEditor editor(good);
    edit(editor);
    editor.repair();
    const Status status = test::read_everything(editor.bytes());
    const ValidationReport report = validate(editor.bytes(), {.threads = 1});
    EXPECT_EQ(status.ok(), report.valid());
    if (!status && !report.valid()) {
        EXPECT_EQ(status.error().code, report.findings[0].code) << status.error().message;
        EXPECT_EQ(status.error().offset, report.findings[0].offset) << status.error().message;
    }
    return status;
}

// Refused with that code for the field at that place.
void expect_refusal(const Bytes &good, const Edit &edit, ErrorCode code, std::uint64_t offset) {
    const Status status = verdict(good, edit);
    ASSERT_FALSE(status) << to_string(code) << " at " << offset;
    EXPECT_EQ(status.error().code, code) << status.error().message;
    EXPECT_EQ(status.error().offset, offset) << status.error().message;
}

template <class T> Edit set(std::size_t at, T value) {
    return [=](FileEditor &file) { file.set<T>(at, value); };
}

Edit set_byte(std::size_t at, std::uint8_t value) { return set<std::uint8_t>(at, value); }

TEST(CheckAlone, BoundsOfTheHeader) {
    expect_refusal(rich_file(), set<std::uint32_t>(104, 131072), ErrorCode::bad_header, 104);
    expect_refusal(rich_file(), set<std::uint64_t>(56, std::uint64_t{1} << 33), ErrorCode::bad_header, 56);
    EXPECT_EQ(Reader::open({}).error().code, ErrorCode::not_bvg);
    EXPECT_EQ(Reader::open(ByteView(rich_file()).first(5)).error().code, ErrorCode::truncated);
}

TEST(CheckAlone, FieldsOfTheTable) {
    const FileEditor file(rich_file());
    const auto field = [&](SectionType type, std::uint32_t instance, std::size_t at) {
        return file.entry(type, instance) + at;
    };
    // Instances of levels: 0 and one beyond the depth, which would stand in order at the ends.
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
    // 5 x 9 = 45 of 48 bytes: a count that the size rounds down to.
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

TEST(CheckAlone, ASectionFarOutsideTheFile) {
    // Aligned to 65,536 the last section starts behind the end of the file.
    FileEditor editor(rich_file());
    const std::size_t at = editor.entry(level_chunks, 3);
    editor.set<std::uint32_t>(at + 16, 65536);
    editor.set<std::uint64_t>(at + 24, 65536);
    ASSERT_LT(editor.bytes().size(), 65536U);
    editor.repair();
    EXPECT_EQ(test::read_everything(editor.bytes()).error().code, ErrorCode::truncated);
    EXPECT_EQ(validate(editor.bytes(), {.threads = 1}).findings[0].code, ErrorCode::truncated);
}

TEST(CheckAlone, BytesBehindTheLastSection) {
    expect_refusal(
        rich_file(),
        [](FileEditor &file) {
            file.bytes().resize(file.bytes().size() + 8, 0);
            file.set<std::uint64_t>(16, file.bytes().size());
        },
        ErrorCode::bad_table, rich_file().size());
}

// Replaces the table: sections may be left out, unknown ones put in. Everything after it keeps its place if the number
// of entries stays.
TEST(CheckAlone, RawSizesThatOverflow) {
    // Two unknown sections behind the others, of 2^50 bytes each that claim 2^63 raw ones, cannot exist: their claims
    // are refused one by one (3.2.10). So is what is left below that.
    FileEditor editor(rich_file());
    const std::size_t at = editor.entry(level_chunks, 3);
    editor.set<std::uint64_t>(at + 40, ~std::uint64_t{0});
    editor.repair();
    EXPECT_EQ(test::read_everything(editor.bytes()).error().code, ErrorCode::too_large);
}

TEST(CheckAlone, ALevelWithoutChunksOrDirectory) {
    for (const SectionType type : {level_directory, level_chunks}) {
        FileEditor editor(rich_file());
        const std::size_t count = editor.get<std::uint32_t>(32), at = editor.entry(type, 1);
        const std::size_t end = kHeaderBytes + kSectionEntryBytes * count;
        // Its entry becomes one of an unknown section, which moves to the end of the table; its bytes stay where they
        // are in the file, so sizes and places are those of a file that never had it.
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

TEST(CheckAlone, BoundsOfTheGrid) {
    const std::size_t at = FileEditor(rich_file()).section(grid);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    expect_refusal(rich_file(), set<double>(at, kInfinity), ErrorCode::bad_section, at);
    expect_refusal(rich_file(), set<double>(at + 16, -kInfinity), ErrorCode::bad_section, at + 16);
    // Each finite, but not their sum.
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

TEST(CheckAlone, RecordsOfAttributes) {
    const std::size_t at = FileEditor(rich_file()).section(attributes);
    const auto field = [&](std::size_t record, std::size_t offset) { return at + 24 * record + offset; };
    expect_refusal(rich_file(), set<std::uint8_t>(field(0, 0), 0), ErrorCode::unsupported_feature, field(0, 0));
    expect_refusal(rich_file(), set<std::uint8_t>(field(2, 1), 0), ErrorCode::unsupported_feature, field(2, 1));
    expect_refusal(rich_file(), set<std::uint8_t>(field(1, 1), 1), ErrorCode::unsupported_feature, field(1, 1));
    expect_refusal(rich_file(), set<std::uint8_t>(field(1, 2), 1), ErrorCode::bad_section, field(1, 0));  // a light
    expect_refusal(rich_file(), set<std::uint8_t>(field(5, 4), 16), ErrorCode::bad_section, field(5, 4)); // bits
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

TEST(CheckAlone, NumbersOfMaterialsAndLights) {
    EXPECT_FALSE(decode_materials({}));
    EXPECT_FALSE(decode_lights({}));
    EXPECT_TRUE(decode_materials(encode_materials(std::vector<Material>(kMaxMaterials))));
    EXPECT_FALSE(decode_materials(encode_materials(std::vector<Material>(kMaxMaterials + 1))));
    EXPECT_TRUE(decode_lights(encode_lights(std::vector<Light>(kMaxLights))));
    EXPECT_FALSE(decode_lights(encode_lights(std::vector<Light>(kMaxLights + 1))));
}

TEST(CheckAlone, BoundsOfMaterialsLightsAndTextures) {
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

TEST(CheckAlone, TheEdgeOfTheGroundPlane) {
    for (const float edge : {-1.0F, 1e-40F, std::numeric_limits<float>::infinity()})
        EXPECT_FALSE(decode_ground_plane(encode_ground_plane({.half_edge = edge, .texture = {}})));
    EXPECT_TRUE(decode_ground_plane(encode_ground_plane({.half_edge = 1e-30F, .texture = {}})));
}

Status metadata_of(const std::string &text) {
    return check_metadata({reinterpret_cast<const std::uint8_t *>(text.data()), text.size()});
}

TEST(CheckAlone, LengthAndNestingOfMetadata) {
    EXPECT_TRUE(metadata_of("{}" + std::string(4094, ' ')));
    EXPECT_FALSE(metadata_of("{}" + std::string(4095, ' ')));
    const auto nested = [](std::size_t depth) {
        return R"({"a":)" + std::string(depth - 1, '[') + std::string(depth - 1, ']') + "}";
    };
    EXPECT_TRUE(metadata_of(nested(32)));
    EXPECT_FALSE(metadata_of(nested(33)));
    EXPECT_FALSE(metadata_of("\xEF\xBB\xBF{}"));
}

struct Directories {
    Reader reader;
    AttributeSet set;

    explicit Directories(const Bytes &file) : reader(Reader::open(file).value()), set(reader.parameters().attributes) {}
    const LevelDirectory &level(int number) { return *reader.directory(number).value(); }
    // The bytes of a level's directory, with one field of one entry changed, decoded again.
    template <class T> Result<LevelDirectory> decode(int number, std::size_t chunk, std::size_t field, T value) {
        Bytes bytes = encode_directory(level(number), set);
        std::memcpy(bytes.data() + chunk * chunk_entry_bytes(set) + field, &value, sizeof value);
        return decode_bytes(number, bytes);
    }
    Result<LevelDirectory> decode_bytes(int number, ByteView bytes) {
        return decode_directory(bytes, number, set, reader.header().chunk_points,
                                number == 1 ? nullptr : &level(number - 1),
                                *reader.section(level_chunks, static_cast<std::uint32_t>(number)));
    }
};

void expect_place(const Result<LevelDirectory> &decoded, std::uint64_t offset,
                  ErrorCode code = ErrorCode::bad_directory) {
    ASSERT_FALSE(decoded) << offset;
    EXPECT_EQ(decoded.error().code, code) << decoded.error().message;
    EXPECT_EQ(decoded.error().offset, offset) << decoded.error().message;
}

TEST(CheckAlone, CountsOfAChunk) {
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
    expect_place(packed.decode<std::uint32_t>(1, 0, 20, 2), 20 + 4); // two nodes at level 0
    expect_place(packed.decode<std::uint32_t>(1, 0, 24, 1), 24);
    expect_place(packed.decode<std::uint32_t>(1, 0, 28, 2), 28);
    expect_place(packed.decode<std::uint32_t>(2, 0, 28, 2), 28);
    expect_place(packed.decode<std::uint32_t>(2, 0, 24, 2), 28); // two parents at level 0
    expect_place(packed.decode_bytes(5, {}), 0);
}

TEST(CheckAlone, TheConeOfAChunk) {
    Directories packed(chunks_file());
    expect_place(packed.decode<std::uint16_t>(5, 0, 36, kNormalCount), 36);
    expect_place(packed.decode<std::int16_t>(5, 0, 38, -32768), 36);
    expect_place(packed.decode<std::uint32_t>(5, 0, 36, 0x80010001), 36); // no cone, but an axis
}

TEST(CheckAlone, PlacesOfChunks) {
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
    // A chunk less: the last parent has points without masks.
    const Bytes all = encode_directory(finest, packed.set);
    expect_place(packed.decode_bytes(5, ByteView(all).first(entry * last)), entry * last);
    expect_place(packed.decode<std::uint32_t>(5, last, 32, 1000), entry * last + 32);
    // In the next octant there is no parent that holds it; where roots are deeper, so may the parent's be.
    for (std::size_t i = 0; i <= last; ++i) {
        const ChunkShape &shape = finest.chunks[i].shape;
        const ChunkShape &parent = packed.level(4).chunks[shape.parent_chunk].shape;
        if (parent.root_depth == 0)
            continue;
        expect_place(packed.decode<std::uint8_t>(5, i, 40, 0), entry * i);
        return;
    }
}

// Counts that are each possible, but not together: parents that lose points to the next.
TEST(CheckAlone, ChunksThatHoldMoreThanTheirParent) {
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
        // A node more than the parent has points; the masks' sizes follow.
        Bytes bytes = encode_directory(finest, packed.set);
        const std::uint32_t nodes = shape.nodes + 1;
        std::memcpy(bytes.data() + entry * i + 20, &nodes, 4);
        expect_place(packed.decode_bytes(5, bytes), entry * i + 20);
        // As many points, but not as many parents as the parent chunk has nodes.
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

TEST(CheckAlone, SizesOfStreams) {
    Directories packed(chunks_file());
    const ChunkEntry &chunk = packed.level(5).chunks[0];
    const std::uint32_t points = chunk.shape.points, nodes = chunk.shape.nodes;
    const std::size_t masks = kChunkEntryFixedBytes, normals = masks + 4, radii = masks + 8;
    constexpr std::uint32_t kZstd = 1U << 31;
    const auto filtered = [](Filter filter) { return static_cast<std::uint32_t>(filter) << 24; };
    const auto refused = [&](std::size_t field, std::uint32_t value) {
        expect_place(packed.decode<std::uint32_t>(5, 0, field, value), field);
    };
    refused(masks, nodes + 1);                       // raw, not of its size
    refused(masks, kZstd);                           // an empty frame
    refused(normals, (2 * points) | kZstd);          // a frame as large as what it holds
    refused(masks, filtered(Filter::mask_rank) | 3); // no room for the planes' entries
    refused(normals, filtered(Filter::normal) | 7);
    refused(radii, filtered(Filter::radius) | points); // as large as without
    refused(radii,
            filtered(Filter::radius) | kZstd | (points - 1)); // planes say for themselves whether they are frames
    expect_place(packed.decode<std::uint32_t>(5, 0, radii, filtered(Filter::normal) | 20), radii,
                 ErrorCode::unsupported_feature);
    // Larger than what is left of the section.
    const std::size_t last = packed.level(5).chunks.size() - 1, entry = chunk_entry_bytes(packed.set);
    const auto stored = packed.level(5).chunks[last].streams;
    ASSERT_NE(stored[1].filter, Filter::none);
    expect_place(
        packed.decode<std::uint32_t>(5, last, normals, filtered(stored[1].filter) | (stored[1].stored_bytes + 1)),
        entry * last + kChunkEntryFixedBytes);
    // Smaller than the section: only the sums tell.
    expect_place(
        packed.decode<std::uint32_t>(5, last, normals, filtered(stored[1].filter) | (stored[1].stored_bytes - 1)),
        entry * (last + 1));
}

TEST(CheckAlone, StreamsOfAMappedFileAreRaw) {
    Directories mapped(chunks_file(Storage::mapped));
    const ChunkEntry &chunk = mapped.level(5).chunks[0];
    const std::uint32_t filter = static_cast<std::uint32_t>(Filter::radius) << 24;
    expect_place(mapped.decode<std::uint32_t>(5, 0, kChunkEntryFixedBytes + 8, filter | (chunk.shape.points - 1)),
                 kChunkEntryFixedBytes);
    expect_place(mapped.decode<std::uint32_t>(5, 0, kChunkEntryFixedBytes + 8, 1U << 31 | (chunk.shape.points - 1)),
                 kChunkEntryFixedBytes);
}

TEST(CheckAlone, TheTableCountsTheChunksAndPointsOfADirectory) {
    // As many records of half the size: what the table says is possible in itself.
    const FileEditor file(chunks_file());
    const std::size_t at = file.entry(level_directory, 5);
    const auto size = file.get<std::uint32_t>(at + 12);
    expect_refusal(
        chunks_file(),
        [=](FileEditor &editor) {
            editor.set<std::uint32_t>(at + 12, size / 2);
            editor.set<std::uint64_t>(at + 48, 2 * editor.get<std::uint64_t>(at + 48));
        },
        ErrorCode::bad_directory, file.section(level_directory, 5));
    const std::size_t points = file.entry(level_chunks, 3) + 48;
    const std::uint64_t end =
        file.section(level_directory, 3) + file.get<std::uint64_t>(file.entry(level_directory, 3) + 32);
    expect_refusal(chunks_file(), set<std::uint64_t>(points, file.get<std::uint64_t>(points) + 1),
                   ErrorCode::bad_directory, end);
}

const Bytes kEven(1000, 7);

TEST(CheckAlone, FramesAreWholeAndOfOneSegment) {
    Bytes frame;
    ASSERT_TRUE(append_frame(kEven, 1, frame).zstd);
    Bytes raw(kEven.size());
    EXPECT_TRUE(decode_frame(frame, true, raw, 0));
    EXPECT_EQ(raw, kEven);
    const auto refuses = [&](const Bytes &bytes, std::size_t size = 1000) {
        Bytes to(size);
        const Status status = decode_frame(bytes, true, to, 77);
        EXPECT_TRUE(status || status.error().offset == 77);
        return !status;
    };
    for (std::size_t size = 0; size < frame.size(); ++size)
        EXPECT_TRUE(refuses(Bytes(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size)))) << size;
    Bytes longer = frame;
    longer.push_back(0);
    EXPECT_TRUE(refuses(longer));
    Bytes two = frame;
    two.insert(two.end(), frame.begin(), frame.end());
    EXPECT_TRUE(refuses(two));
    EXPECT_TRUE(refuses(frame, 999));
    EXPECT_TRUE(refuses(frame, 1001));
    for (const unsigned bit : {0U, 1U, 3U, 5U}) { // dictionary, reserved, single segment
        Bytes other = frame;
        other[4] ^= static_cast<std::uint8_t>(1U << bit);
        EXPECT_TRUE(refuses(other)) << bit;
    }
    // A skippable frame of four bytes, of which zstd makes nothing.
    EXPECT_TRUE(refuses({0x50, 0x2A, 0x4D, 0x18, 4, 0, 0, 0, 1, 2, 3, 4}, 0));
    // A block of a type that does not exist.
    Bytes broken = frame;
    broken[7] |= 6;
    EXPECT_TRUE(refuses(broken));
}

TEST(CheckAlone, SizesOfPlanes) {
    Bytes stored;
    const std::vector<Bytes> planes{kEven, Bytes(5, 1)};
    append_planes(planes, 1, stored);
    const auto cut = [&](std::size_t at, std::uint8_t bits, std::size_t first = 1000) {
        Bytes bytes = stored;
        bytes[at] ^= bits;
        PlaneCursor cursor(bytes, 2);
        ByteView plane;
        bool zstd = false;
        return cursor.next(first, plane, zstd) && cursor.next(5, plane, zstd) && cursor.finished();
    };
    EXPECT_TRUE(cut(0, 0));
    EXPECT_FALSE(cut(3, 1));    // a bit between size and zstd
    EXPECT_FALSE(cut(2, 1));    // 65,536 bytes more than there are
    EXPECT_FALSE(cut(0, 0, 5)); // a frame larger than what it holds
    EXPECT_FALSE(cut(4, 1));    // raw, and a byte less
    EXPECT_FALSE(cut(0, 1));    // the second plane starts elsewhere and does not end with the bytes
}

// Decodes the first chunk of the test vectors that has a stream with that filter, whose stored bytes `damage` changes.
Status decode_damaged(Filter filter, const std::function<void(Bytes &)> &damage) {
    for (const char *name : {"filtered.bvg", "filtered-565.bvg", "filtered-regions.bvg"}) {
        const MappedFile file =
            MappedFile::open(std::string(PBM_SOURCE_DIR "/format_spec/vectors/valid/") + name).value();
        Reader reader = Reader::open(file.bytes()).value();
        const Model model = load_model(reader, {.threads = 1}).value();
        for (int level = 1; level <= reader.depth(); ++level)
            for (ChunkEntry entry : reader.directory(level).value()->chunks) {
                Bytes stored;
                bool found = false;
                std::size_t at = entry.offset;
                for (StreamEntry &stream : entry.streams) {
                    const ByteView view = file.bytes().subspan(at, stream.stored_bytes);
                    Bytes bytes(view.begin(), view.end());
                    at += stream.stored_bytes;
                    if (stream.filter == filter && !found) {
                        found = true;
                        damage(bytes);
                        stream.stored_bytes = static_cast<std::uint32_t>(bytes.size());
                    }
                    stored.insert(stored.end(), bytes.begin(), bytes.end());
                }
                if (!found)
                    continue;
                entry.stored_bytes = stored.size();
                entry.hash = hash64(stored);
                const Level &above = model.levels[static_cast<std::size_t>(level) - 1];
                Chunk chunk;
                return decode_chunk(entry, stored, reader.chunk_rules(level),
                                    parent_nodes(entry, above.masks, 0, above.points, 0, model.parameters.attributes),
                                    chunk);
            }
    }
    ADD_FAILURE() << "no stream with filter " << static_cast<int>(filter);
    return {};
}

TEST(CheckAlone, PlanesOfEveryFilter) {
    for (const Filter filter : {Filter::mask_rank, Filter::normal, Filter::radius, Filter::colour565, Filter::colour888,
                                Filter::material, Filter::texture, Filter::shadow}) {
        EXPECT_TRUE(decode_damaged(filter, [](Bytes &) {})) << static_cast<int>(filter);
        // A byte behind the last plane; each plane's size off by one; a bit that is none of a size.
        EXPECT_FALSE(decode_damaged(filter, [](Bytes &bytes) { bytes.push_back(0); })) << static_cast<int>(filter);
        for (std::size_t plane = 0; plane < plane_count(filter); ++plane) {
            EXPECT_FALSE(decode_damaged(filter, [&](Bytes &bytes) { bytes[4 * plane] ^= 1; })) << plane;
            EXPECT_FALSE(decode_damaged(filter, [&](Bytes &bytes) { bytes[4 * plane + 3] ^= 1; })) << plane;
        }
    }
}

TEST(CheckAlone, AConeHoldsNoTwoSidedPoint) {
    Directories packed(chunks_file());
    const Model model = load_model(packed.reader).value();
    for (const int level : {4, 5})
        for (const ChunkEntry &entry : packed.level(level).chunks) {
            NormalOccurrence occurs{};
            const std::span<const std::uint16_t> normals =
                std::span(model.levels[static_cast<std::size_t>(level)].points.normals)
                    .subspan(entry.first_point, entry.shape.points);
            ASSERT_TRUE(mark_normals(normals, occurs, 0));
            ASSERT_TRUE(check_cone(occurs, entry.cone, 0));
            if (entry.cone.cosine == kNoCone)
                continue;
            occurs[normals[0] | kTwoSidedBit] = 1;
            EXPECT_FALSE(check_cone(occurs, entry.cone, 0));
        }
}

TEST(CheckAlone, StreamsOfMappedChunks) {
    const FileEditor file(mapped_file());
    const AttributeSet set = every_attribute(ColourFormat::rgb888, 3);
    const std::vector<StreamInfo> streams = streams_of(set);
    std::uint64_t at = file.section(level_chunks, 3);
    const ChunkEntry chunk = Directories(mapped_file()).level(3).chunks[0];
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const std::uint64_t place = at;
        at += align_stream(chunk.streams[s].stored_bytes);
        const auto value = [&](std::uint8_t byte) { return set_byte(place, byte); };
        switch (streams[s].kind) {
        case StreamKind::masks: // its children are counted
            expect_refusal(mapped_file(), value(0), ErrorCode::bad_octree, chunk.offset);
            break;
        case StreamKind::normal:
            expect_refusal(mapped_file(), set_byte(place + 1, 0xC0), ErrorCode::bad_attribute, place);
            break;
        case StreamKind::radius: expect_refusal(mapped_file(), value(204), ErrorCode::bad_attribute, place); break;
        case StreamKind::material: expect_refusal(mapped_file(), value(3), ErrorCode::bad_attribute, place); break;
        case StreamKind::shadow:
            if (chunk.shape.points % 8 != 0 && streams[s].light == 0)
                expect_refusal(mapped_file(), set_byte(place + chunk.streams[s].stored_bytes - 1, 0xFF),
                               ErrorCode::bad_attribute, place);
            break;
        case StreamKind::colour:
        case StreamKind::texture: break;
        }
    }
}

TEST(CheckAlone, EveryFieldOfABrick) {
    const FileEditor file(chunks_file(Storage::mapped));
    const std::size_t at = file.section(level_bricks, 5) + kBrickRecordBytes;
    const std::array<std::pair<std::size_t, std::size_t>, 12> fields{
        {{0, 0}, {2, 0}, {4, 0}, {6, 6}, {8, 6}, {10, 10}, {12, 10}, {14, 14}, {15, 14}, {16, 16}, {20, 16}, {23, 16}}};
    for (const auto &[field, named] : fields)
        expect_refusal(
            chunks_file(Storage::mapped), [&, flipped = at + field](FileEditor &editor) { editor.flip(8 * flipped); },
            ErrorCode::bad_content, at + named);
}

// Decodes the directory of a raster of 4 x 4 texels after an edit; its hash is right.
Result<ImageDirectory> raster(std::uint32_t channels, Storage storage, const std::function<void(Bytes &)> &edit) {
    static Bytes section;
    section = encode_image(test::test_image(4, 4, channels), storage, 1, 1);
    edit(section);
    const std::uint64_t hash = hash64(ByteView(section).subspan(8, 24 + 16 * 3));
    std::memcpy(section.data(), &hash, sizeof hash);
    return decode_image_directory(section, 0);
}

template <class T> auto put(std::size_t at, T value) {
    return [=](Bytes &bytes) { std::memcpy(bytes.data() + at, &value, sizeof value); };
}

TEST(CheckAlone, TilesOfARaster) {
    constexpr std::uint32_t kZstd = 1U << 31, kFilter = static_cast<std::uint32_t>(Filter::texels) << 24;
    const std::size_t last = 32 + 2 * 16 + 8; // stored size, filter and zstd of the 4 x 4 texels
    EXPECT_TRUE(raster(3, Storage::packed, [](Bytes &) {}).ok());
    const auto refused = [&](std::uint32_t entry, std::uint32_t channels = 3, Storage storage = Storage::packed) {
        const Result<ImageDirectory> directory = raster(channels, storage, put(last, entry));
        EXPECT_EQ(directory ? 0 : directory.error().offset, last);
        return !directory && directory.error().code == ErrorCode::bad_image;
    };
    EXPECT_TRUE(refused(47));                   // raw, not of its size
    EXPECT_TRUE(refused(kZstd));                // an empty frame
    EXPECT_TRUE(refused(kZstd | 48));           // a frame as large as what it holds
    EXPECT_TRUE(refused(kFilter | 11));         // no room for the planes' entries
    EXPECT_TRUE(refused(kFilter | 48));         // as large as without
    EXPECT_TRUE(refused(kFilter | kZstd | 20)); // planes say for themselves whether they are frames
    EXPECT_TRUE(refused(kFilter | 5, 1, Storage::mapped));
    EXPECT_TRUE(refused(kZstd | 5, 1, Storage::mapped));
}

TEST(CheckAlone, ShapesOfRasters) {
    EXPECT_TRUE(is_storable(4, 2, 3));
    EXPECT_TRUE(is_storable(kMaxPanoramaWidth, kMaxPanoramaWidth / 2, 3));
    EXPECT_FALSE(is_storable(4, 3, 3));
    EXPECT_FALSE(is_storable(2 * kMaxPanoramaWidth, kMaxPanoramaWidth, 3));
    EXPECT_FALSE(is_storable(8, 2, 3));
    EXPECT_FALSE(is_storable(2, 4, 1));
    EXPECT_FALSE(is_storable(4, 2, 2));
    EXPECT_FALSE(is_storable(0, 0, 1));
    // As a section of a file: what its type may be, stored as the file is, and as the table says.
    const auto read = [](std::uint32_t width, std::uint32_t height, std::uint32_t channels, SectionType type,
                         std::uint64_t more_raw = 0, Storage file = Storage::packed) {
        const Bytes section = encode_image(test::test_image(width, height, channels), Storage::packed, 1, 1);
        const TileGrid tiles(width, height, channels);
        const SectionEntry entry{.type = type,
                                 .offset = 0,
                                 .stored_bytes = section.size(),
                                 .raw_bytes = image_directory_bytes(tiles) + tiles.texel_bytes() + more_raw,
                                 .count = tiles.tiles()};
        return read_image_directory(section, entry, file).ok();
    };
    EXPECT_TRUE(read(4, 2, 3, panorama));
    EXPECT_FALSE(read(4, 2, 1, panorama));
    EXPECT_FALSE(read(4, 4, 3, panorama));
    EXPECT_TRUE(read(4, 4, 1, ground_texture));
    EXPECT_FALSE(read(4, 4, 3, ground_texture));
    EXPECT_FALSE(read(4, 2, 1, ground_lit));
    EXPECT_FALSE(read(4, 2, 3, panorama, 1));
    EXPECT_FALSE(read(4, 2, 3, panorama, 0, Storage::mapped));
}

// What a brick counts must be there, also where the memory behind it happens to hold more.
TEST(CheckAlone, BricksEndWithTheirChunk) {
    const std::vector<std::uint16_t> normals(64, 0);
    const Bytes radii(64, 9), masks(8, 0x81);
    const ChunkShape shape{.points = 4, .nodes = 2, .parents = 1, .bricks = 1};
    const std::array<BrickRecord, 1> above{BrickRecord{.node_map = 1}};
    const Bytes masks_above(8, 0x03); // two nodes below the only one
    std::array<BrickRecord, 1> bricks;
    const auto index = [&](std::size_t mask_count, std::size_t points, std::size_t masks_there = 1,
                           ChunkShape changed = {}) {
        if (changed.bricks == 0)
            changed = shape;
        return index_bricks({.bricks = above, .masks = ByteView(masks_above).first(masks_there), .first = 0}, changed,
                            2, ByteView(masks).first(mask_count), std::span(normals).first(points),
                            ByteView(radii).first(points), bricks);
    };
    EXPECT_TRUE(index(2, 4));
    EXPECT_FALSE(index(1, 2));
    EXPECT_FALSE(index(2, 3));
    EXPECT_FALSE(index(3, 4)); // a mask that belongs to no brick
    EXPECT_FALSE(index(2, 5));
    EXPECT_FALSE(index(2, 4, 0));
}

// Without its neighbours' help: what later checks would refuse as well is refused here, by its own rule.
TEST(CheckAlone, PlacesInTheGridAndKindsInOrder) {
    Grid grid{.depth = 3, .origin = {std::numeric_limits<double>::quiet_NaN(), 0, 0}};
    EXPECT_EQ(decode_grid(encode_grid(grid), 3).error().offset, 0U);
    // Texture values twice.
    Bytes records = encode_attributes({.texture = true}, 3);
    const Bytes last(records.end() - 24, records.end());
    records.insert(records.end(), last.begin(), last.end());
    EXPECT_EQ(decode_attributes(records, 3).error().offset, 72U);
}

TEST(CheckAlone, ARasterOfTheGroundIsAtMost4096TexelsWide) {
    const std::uint32_t edge = 2 * kMaxGroundRaster;
    const TileGrid tiles(edge, edge, 1);
    ByteWriter directory; // of tiles that are all one frame of nothing
    for (const std::uint32_t field : {edge, edge, static_cast<std::uint32_t>(tiles.tiles())})
        directory.u32(field);
    directory.u16(1);
    directory.u8(1);
    directory.zeros(9);
    std::uint64_t end = 0;
    for (std::size_t tile = 0; tile < tiles.tiles(); ++tile) {
        const std::size_t raw = tiles.tile_bytes(tiles.level_of(tile));
        const std::uint32_t stored = raw == 1 ? 1 : 1U << 31 | 1U;
        directory.u64(0);
        directory.u32(stored);
        directory.u32(0);
        ++end;
    }
    ByteWriter section;
    section.u64(hash64(directory.bytes()));
    section.append(directory.bytes());
    section.zeros(end);
    SectionEntry entry{.type = ground_lit,
                       .offset = 0,
                       .stored_bytes = section.size(),
                       .raw_bytes = image_directory_bytes(tiles) + tiles.texel_bytes(),
                       .count = tiles.tiles()};
    ASSERT_TRUE(decode_image_directory(section.bytes(), 0).ok());
    EXPECT_FALSE(read_image_directory(section.bytes(), entry, Storage::packed));
}

} // namespace
} // namespace pbm
