// Compares the byte tables of BVG.md with the bytes that the library writes: order, offset and size of each row.
#include "pbm_format/chunks/brick_index.h"
#include "pbm_format/container/field_sections.h"
#include "pbm_format/container/layout.h"
#include "pbm_format/container/point_streams.h"
#include "pbm_format/container/section_encoder.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/writing/raster_encoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace pbm {
namespace {

struct Row {
    std::size_t at, bytes;
    std::string field;
};
using Table = std::vector<Row>;

// The tables of BVG.md that have the columns at, bytes and field, in the order of the text.
std::vector<Table> read_tables() {
    std::ifstream text(PBM_SOURCE_DIR "/format_spec/BVG.md");
    const std::regex row(R"(\| (\d+) \| (\d+)(?: each)? \| (.*) \|)");
    std::vector<Table> tables;
    bool inside = false;
    for (std::string line; std::getline(text, line);) {
        std::smatch match;
        if (line == "| at | bytes | field |") {
            tables.emplace_back();
            inside = true;
        } else if (inside && std::regex_match(line, match, row)) {
            tables.back().push_back({std::stoul(match[1]), std::stoul(match[2]), match[3]});
        } else if (!line.starts_with("|---")) {
            inside = false;
        }
    }
    return tables;
}

// The order of the tables in BVG.md.
enum TableNumber : std::uint8_t {
    header_table,
    root_table,
    entry_table,
    grid_table,
    attribute_table,
    material_table,
    light_table,
    texture_table,
    raster_table,
    tile_table,
    ground_table,
    chunk_table,
    brick_table,
    field_table,
    field_entry_table,
    shape_table,
    point_stream_table,
    table_count
};

const Table &table(TableNumber number) {
    static const std::vector<Table> kTables = read_tables();
    static const Table kNone;
    return kTables.size() == table_count ? kTables[number] : kNone;
}

// Expected row: the start of its text, and its bytes.
struct RecordField {
    std::string name;
    Bytes bytes;
};

RecordField integer(std::string name, std::uint64_t value, std::size_t bytes) {
    RecordField field{std::move(name), Bytes(bytes)};
    for (std::size_t i = 0; i < bytes; ++i)
        field.bytes[i] = static_cast<std::uint8_t>(value >> 8 * i);
    return field;
}
RecordField zeros(std::size_t bytes) { return {"zero", Bytes(bytes)}; }
template <typename Real, std::size_t N> RecordField reals(std::string name, const std::array<Real, N> &values) {
    RecordField field{std::move(name), Bytes(sizeof values)};
    std::memcpy(field.bytes.data(), values.data(), sizeof values);
    return field;
}
RecordField real(std::string name, float value) { return reals(std::move(name), std::array{value}); }
RecordField colour(std::string name, Rgb8 value) { return {std::move(name), Bytes(value.begin(), value.end())}; }

// Compares each field of `record` and each row of the table with `expected`. The rows must leave no gap.
void expect_table(TableNumber number, ByteView record, const std::vector<RecordField> &expected) {
    const Table &rows = table(number);
    ASSERT_EQ(rows.size(), expected.size()) << "table " << number;
    std::size_t end = rows.front().at;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Row &row = rows[i];
        EXPECT_TRUE(row.field.starts_with(expected[i].name)) << row.field << " is not " << expected[i].name;
        EXPECT_EQ(row.at, end) << row.field;
        EXPECT_EQ(row.bytes, expected[i].bytes.size()) << row.field;
        end = row.at + row.bytes;
        ASSERT_LE(end, record.size()) << row.field;
        EXPECT_TRUE(std::ranges::equal(record.subspan(row.at, row.bytes), expected[i].bytes)) << row.field;
    }
    EXPECT_EQ(end, number == root_table ? 104 : record.size());
}

FileHeader some_header() {
    FileHeader header;
    header.minor = kMinorVersion;
    header.file_size = 0x1122334455667788;
    header.table_count = 0x21222324;
    header.depth = 11;
    header.required_features = 0x3132333435363738;
    header.optional_features = 0x4142434445464748;
    header.point_count = 0x5152535455565758;
    header.raw_bytes = 0x6162636465666768;
    header.content_id = {0x7172737475767778, 0x8182838485868788};
    header.root = {{0x92, 0x91, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 1, 2, 3, 4, 5, 6, 7, 8}};
    header.chunk_points = 0xA1A2A3A4;
    header.table_hash = 0xB1B2B3B4B5B6B7B8;
    return header;
}

TEST(ByteTables, AreSeventeen) { EXPECT_EQ(read_tables().size(), table_count); }

TEST(ByteTables, OfTheHeaderAreTheCode) {
    const FileHeader header = some_header();
    const Bytes bytes = encode_header(header);
    ASSERT_EQ(bytes.size(), kHeaderBytes);
    const ByteView root = ByteView(bytes).subspan(88, 16);
    expect_table(header_table, bytes,
                 {{"magic", Bytes(kMagic.begin(), kMagic.end())},
                  integer("major version", kMajorVersion, 2),
                  integer("minor version", header.minor, 2),
                  integer("endian tag", kEndianTag, 4),
                  integer("file size", header.file_size, 8),
                  integer("table offset", kHeaderBytes, 8),
                  integer("table entries", header.table_count, 4),
                  integer("depth", header.depth, 1),
                  zeros(3),
                  integer("required features", header.required_features, 8),
                  integer("optional features", header.optional_features, 8),
                  integer("points", header.point_count, 8),
                  integer("raw bytes", header.raw_bytes, 8),
                  reals("content_id", header.content_id),
                  {"root record", Bytes(root.begin(), root.end())},
                  integer("chunk limit", header.chunk_points, 4),
                  zeros(4),
                  integer("XXH3-64 of the section table", header.table_hash, 8),
                  integer("XXH3-64 of bytes 0..119", hash64(ByteView(bytes).first(120)), 8)});
    expect_table(root_table, bytes,
                 {integer("normal", header.root.normal(), 2), colour("colour R, G, B", header.root.colour()),
                  integer("material", header.root.value({StreamKind::material}), 1),
                  integer("splat radius", header.root.value({StreamKind::radius}), 1),
                  integer("texture value", header.root.value({StreamKind::texture}), 1),
                  reals("lit fraction", std::array<std::uint8_t, kMaxLights>{1, 2, 3, 4, 5, 6, 7, 8})});
}

TEST(ByteTables, OfASectionEntryIsTheCode) {
    const SectionEntry entry{.type = SectionType{0x01020304},
                             .codec = Codec{0x0506},
                             .flags = 0x0708,
                             .instance = 0x090A0B0C,
                             .element_bytes = 0x0D0E0F10,
                             .alignment = 0x11121314,
                             .offset = 0x2122232425262728,
                             .stored_bytes = 0x3132333435363738,
                             .raw_bytes = 0x4142434445464748,
                             .count = 0x5152535455565758,
                             .hash = 0x6162636465666768};
    expect_table(entry_table, encode_section_table(std::array{entry}),
                 {integer("type", 0x01020304, 4), integer("codec", 0x0506, 2), integer("flags", 0x0708, 2),
                  integer("instance", entry.instance, 4), integer("element size", entry.element_bytes, 4),
                  integer("alignment", entry.alignment, 4), zeros(4), integer("offset in the file", entry.offset, 8),
                  integer("stored bytes", entry.stored_bytes, 8), integer("raw bytes", entry.raw_bytes, 8),
                  integer("count", entry.count, 8), integer("XXH3-64", entry.hash, 8)});
}

TEST(ByteTables, OfTheGridIsTheCode) {
    const Grid grid{
        .depth = 7, .origin = {1.5, -2.25, 3.125}, .voxel_size = 0.0625, .unit = Unit::inch, .up = UpAxis::x};
    expect_table(grid_table, encode_grid(grid),
                 {reals("minimum corner", grid.origin), reals("voxel size", std::array{grid.voxel_size}),
                  integer("unit", 4, 1), integer("up axis", 2, 1), zeros(14)});
}

TEST(ByteTables, OfAttributesIsTheCode) {
    constexpr int kDepth = 5;
    AttributeSet set{.colour = ColourFormat::rgb888, .material = true, .texture = true, .lights = 2};
    set.shadow_bits[0].fill(0);
    for (std::size_t level = 0; level <= kDepth; ++level) {
        set.shadow_bits[0][level] = level < 3 ? 8 : 4;
        set.shadow_bits[1][level] = level < 2 ? 2 : 1;
    }
    const Bytes bytes = encode_attributes(set, kDepth);
    const std::array<std::uint8_t, 7> kinds{1, 2, 3, 4, 5, 6, 6}, formats{0, 0, 2, 0, 0, 0, 0},
        lights{0, 0, 0, 0, 0, 0, 1};
    ASSERT_EQ(bytes.size(), 24 * kinds.size());
    for (std::size_t i = 0; i < kinds.size(); ++i)
        expect_table(attribute_table, ByteView(bytes).subspan(24 * i, 24),
                     {integer("kind", kinds[i], 1), integer("format of colour", formats[i], 1),
                      integer("light", lights[i], 1), zeros(1),
                      i < 5 ? RecordField{"shadow", Bytes(17)} : reals("shadow", set.shadow_bits[i - 5]), zeros(3)});
}

TEST(ByteTables, OfMaterialsAndLightsAreTheCode) {
    const Material material{
        .ka = 0.125F, .kd = 0.25F, .ks = 0.5F, .power = 32, .colour = {1, 2, 3}, .environment = 0.75F};
    expect_table(material_table, encode_materials(std::array{material}),
                 {real("ka", 0.125F), real("kd", 0.25F), real("ks", 0.5F), real("specular exponent", 32),
                  colour("colour", material.colour), zeros(1), real("environment", 0.75F), zeros(8)});
    const Light light{.kind = LightKind::spot,
                      .intensity = {1, 2, 3},
                      .position = {4, 5, 6},
                      .direction = {0.6F, 0, -0.8F},
                      .exponent = 7};
    expect_table(light_table, encode_lights(std::array{light}),
                 {integer("kind", 2, 1), zeros(3), reals("intensity", light.intensity),
                  reals("position", light.position), reals("direction", light.direction), real("spot exponent", 7),
                  zeros(4)});
}

TEST(ByteTables, OfTextureAndGroundPlaneAreTheCode) {
    SolidTexture texture{.kind = TextureKind::wood, .seed = 0x01020304, .scale = 2, .turbulence = 3};
    RecordField palette{"palette", {}};
    for (std::size_t i = 0; i < 256; ++i) {
        const auto v = static_cast<std::uint8_t>(i);
        texture.palette[i] = {v, static_cast<std::uint8_t>(v ^ 0x55), static_cast<std::uint8_t>(255 - v)};
        palette.bytes.insert(palette.bytes.end(), texture.palette[i].begin(), texture.palette[i].end());
    }
    const Bytes record = encode_texture(texture);
    expect_table(texture_table, record,
                 {integer("kind", 2, 1), zeros(3), integer("seed", texture.seed, 4), real("scale", 2),
                  real("turbulence", 3), zeros(16), palette});
    const GroundPlane ground{.centre = {1, 2, 3}, .half_edge = 4, .material = 5, .texture = texture};
    expect_table(ground_table, encode_ground_plane(ground),
                 {reals("centre", ground.centre),
                  real("half of the edge", 4),
                  integer("material", 5, 1),
                  zeros(15),
                  {"texture record", record}});
}

TEST(ByteTables, OfRastersAreTheCode) {
    Image image{.width = 4, .height = 2, .channels = 3, .texels = Bytes(24)};
    for (std::size_t i = 0; i < image.texels.size(); ++i)
        image.texels[i] = static_cast<std::uint8_t>(37 * i);
    const Bytes section = encode_image(image, Storage::mapped, 1, 1);
    const std::size_t directory = 32 + 2 * 16;
    ASSERT_GT(section.size(), directory);
    expect_table(raster_table, ByteView(section).first(32),
                 {integer("XXH3-64", hash64(ByteView(section).subspan(8, directory - 8)), 8), integer("width", 4, 4),
                  integer("height", 2, 4), integer("tiles", 2, 4), integer("alignment", 64, 2),
                  integer("channels", 3, 1), zeros(9)});
    // Mip level 1 has two texels, level 0 eight; tiles start at multiples of 64.
    for (std::size_t tile = 0; tile < 2; ++tile) {
        const std::size_t size = tile == 0 ? 6 : 24;
        expect_table(tile_table, ByteView(section).subspan(32 + 16 * tile, 16),
                     {integer("XXH3-64", hash64(ByteView(section).subspan(64 + 64 * tile, size)), 8),
                      integer("bits 0..23 stored bytes, 24..30 filter, 31 zstd", size, 4), zeros(4)});
    }
}

TEST(ByteTables, OfFieldsAreTheCode) {
    const Field field{
        .name = "class", .unit = "m", .offset = -2.5, .scale = 0.125, .bytes = 2, .average = FieldAverage::maximum};
    const Bytes section = encode_fields({.id = {0x0102030405060708, 9}, .fields = {field}, .roots = {0x1234}});
    ASSERT_EQ(section.size(), 112U);
    const auto text = [](std::string_view letters, std::size_t size) {
        Bytes bytes(letters.begin(), letters.end());
        bytes.resize(size);
        return bytes;
    };
    expect_table(field_table, ByteView(section).subspan(16),
                 {{"name", text("class", 32)},
                  {"unit", text("m", 16)},
                  reals("offset", std::array{-2.5}),
                  reals("scale", std::array{0.125}),
                  integer("bytes", 2, 1),
                  integer("average", 2, 1),
                  integer("stored value of level 0", 0x1234, 2),
                  zeros(28)});
    const FieldEntry entry{.hash = 0x3132333435363738,
                           .stream = {.stored_bytes = 0x123456, .filter = Filter::field16, .zstd = false}};
    expect_table(field_entry_table, encode_field_directory({.entries = {entry}, .fields = 1}),
                 {integer("XXH3-64", entry.hash, 8), integer("bits 0..23", 0x0A123456, 4)});
}

TEST(ByteTables, OfShapesIsTheCode) {
    const Material material{.shape = PointShape::round, .tint = 37};
    expect_table(shape_table, encode_shapes(std::array{material}),
                 {integer("shape", 1, 1), integer("tint", 37, 1), {"later versions", Bytes(6)}});
}

TEST(ByteTables, OfPointStreamsAreTheCode) {
    const PointStreamEntry entry{
        .hash = 0x0102030405060708, .stored_bytes = 0x111213, .raw_bytes = 0x21222324, .zstd = true};
    expect_table(point_stream_table, encode_stream_directory(std::array{entry}),
                 {integer("XXH3-64", entry.hash, 8), integer("bits 0..23 stored bytes", 0x80111213, 4),
                  integer("raw bytes", entry.raw_bytes, 4)});
}

TEST(ByteTables, OfAChunkEntryIsTheCode) {
    ChunkEntry entry;
    entry.shape.root_prefix = 0x0102030405060708;
    entry.shape.points = 0x11121314;
    entry.shape.nodes = 0x15161718;
    entry.shape.parents = 0x191A1B1C;
    entry.shape.bricks = 0x1D1E1F20;
    entry.shape.parent_chunk = 0x21222324;
    entry.shape.root_depth = 9;
    entry.cone = {.axis = 0x1234, .cosine = -0x4567};
    entry.hash = 0x3132333435363738;
    entry.streams = {{.stored_bytes = 0x123456, .filter = Filter::mask_rank, .zstd = false},
                     {.stored_bytes = 0x654321, .filter = Filter::none, .zstd = true},
                     {.stored_bytes = 0x010203, .filter = Filter::radius, .zstd = false}};
    const Bytes bytes = encode_directory({.level = 3, .chunks = {entry}}, AttributeSet{});
    ASSERT_EQ(bytes.size(), 60U);
    // The last row repeats for each stream.
    expect_table(chunk_table, ByteView(bytes).first(52),
                 {integer("root prefix", entry.shape.root_prefix, 8), integer("XXH3-64", entry.hash, 8),
                  integer("points", entry.shape.points, 4), integer("nodes", entry.shape.nodes, 4),
                  integer("parents", entry.shape.parents, 4), integer("bricks", entry.shape.bricks, 4),
                  integer("parent chunk", entry.shape.parent_chunk, 4), integer("axis", 0x1234, 2),
                  integer("cosine", 0x10000 - 0x4567, 2), integer("root depth", 9, 1), zeros(7),
                  integer("per stream: bits 0..23 stored bytes, 24..30 filter, 31 zstd", 0x01123456, 4)});
    EXPECT_EQ(Bytes(bytes.begin() + 52, bytes.end()), (Bytes{0x21, 0x43, 0x65, 0x80, 0x03, 0x02, 0x01, 0x03}));
}

TEST(ByteTables, OfABrickIsTheCode) {
    const BrickRecord brick{.x = 0x0102,
                            .y = 0x0304,
                            .z = 0x0506,
                            .first_point = 0x0708,
                            .first_node = 0x090A,
                            .cone_axis = 0x0B0C,
                            .cone_cosine = 0x0D0E,
                            .largest_radius = 0x0F,
                            .flags = 0x10,
                            .node_map = 0x1112131415161718};
    Bytes bytes(sizeof brick);
    std::memcpy(bytes.data(), &brick, sizeof brick);
    expect_table(brick_table, bytes,
                 {integer("x, y, z", 0x050603040102, 6), integer("first point", 0x0708, 2),
                  integer("first node", 0x090A, 2), integer("axis", 0x0B0C, 2), integer("cosine", 0x0D0E, 2),
                  integer("largest radius", 0x0F, 1), integer("flags", 0x10, 1),
                  integer("node map", 0x1112131415161718, 8)});
}

} // namespace
} // namespace pbm
