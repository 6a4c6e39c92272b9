#include "pbm_build/radii/splat_radius.h"
#include "pbm_scan/surface_reader.h"
#include "ply_points.h"
#include "unit/build/built_models.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::file_of;
using test::Random;

// Random voxels of `grid` with every attribute that a PLY row holds. All normals occur, on one-sided and two-sided
// points, all radii of the builder, and all 565 colours.
Model colourful_model(const Grid &grid, ColourFormat colour, std::size_t count) {
    Random random(7);
    std::vector<MortonCode> codes;
    for (std::size_t i = 0; i < count; ++i)
        codes.push_back(random.below(MortonCode{1} << 3 * grid.depth));
    std::sort(codes.begin(), codes.end());
    codes.erase(std::unique(codes.begin(), codes.end()), codes.end());

    Model model;
    model.metadata = R"({"name":"two\nlines","licence":"CC0","options":{}})";
    ModelParameters &parameters = model.parameters;
    parameters.grid = grid;
    parameters.attributes.colour = colour;
    parameters.attributes.material = true;
    parameters.materials = {{}, {0.1F, 0.3F, 1.0F / 3, 1024, {1, 2, 255}, 1}, {0, 1, 0, 0.7F, {0, 0, 1}, 0.1F}};
    parameters.materials[2].shape = PointShape::round;
    parameters.materials[1].tint = 201;
    PointAttributes points;
    points.resize(codes.size(), parameters.attributes);
    const RadiusClasses classes = radius_classes(grid.depth);
    for (std::size_t i = 0; i < codes.size(); ++i) {
        points.normals[i] = static_cast<std::uint16_t>(i % (2 * kNormalCount));
        if (i % 3 == 2) // a round one shows both of its sides
            points.normals[i] |= kTwoSidedBit;
        points.radii[i] = classes[i % classes.size()];
        const std::uint64_t any = i * 40503;
        set_point_colour(points, i, colour,
                         {static_cast<std::uint8_t>(any), static_cast<std::uint8_t>(any >> 8),
                          static_cast<std::uint8_t>(any >> 16)});
        points.materials[i] = static_cast<std::uint8_t>(i % 3);
    }
    set_levels(model, std::move(codes), std::move(points), 2);
    return model;
}

Result<Bytes> exported(const Bytes &file, PlyFormat format, StreamOptions options) {
    Result<Reader> reader = Reader::open(file);
    if (!reader)
        return reader.error();
    const std::uint64_t count = options.level == 0 ? 1 : value_of(reader->directory(options.level))->points;
    const Result<PlyPoints> ply = PlyPoints::of(*reader, options.level, count, format);
    if (!ply)
        return ply.error();
    Bytes bytes;
    const auto append = [&](const auto &more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
    append(ply->header());
    Status status = stream_points(*reader, options,
                                  {.row_bytes = ply->row_bytes(),
                                   .encode = [&](const PointBlock &block) { return ply->rows(block); },
                                   .write =
                                       [&](ByteView rows) {
                                           append(rows);
                                           return Status();
                                       }});
    if (!status)
        return status.error();
    append(ply->materials());
    return bytes;
}

Model built(const Bytes &ply, const Grid &grid, ColourFormat colour) {
    Result<Surface> surface = read_surface(ply, "points.ply", {.strict = true, .progress = {}});
    EXPECT_TRUE(surface.ok()) << (surface.ok() ? "" : surface.error().message);
    BuildOptions options;
    options.grid.like = grid;
    options.colour = colour;
    BuildStatistics statistics;
    Result<Model> model = build_model(surface.ok() ? std::move(*surface) : Surface{}, options, statistics);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
    return model.ok() ? std::move(*model) : Model{};
}

void expect_same(const Model &model, PlyFormat format) {
    const Grid &grid = model.parameters.grid;
    const ColourFormat colour = model.parameters.attributes.colour;
    const auto ply = exported(file_of(model), format, {.level = grid.depth});
    ASSERT_TRUE(ply.ok()) << ply.error().message;
    const Model again = built(*ply, grid, colour);
    EXPECT_EQ(again.parameters, model.parameters);
    EXPECT_EQ(again.levels, model.levels) << "depth " << grid.depth << " near " << grid.origin[0];
}

TEST(Export, BuildingExportedPointsGivesTheSameModel) {
    for (int depth = kMinBuildDepth; depth <= kMaxDepth; ++depth)
        expect_same(colourful_model({.depth = depth, .origin = {-1, 2, 1.0 / 3}, .voxel_size = 0.1}, //
                                    ColourFormat::rgb888, 20000),
                    {});
    expect_same(colourful_model({.depth = 9}, ColourFormat::rgb565, 140000), {});
}

TEST(Export, TextHoldsEveryBit) {
    expect_same(colourful_model({.depth = 8, .origin = {-1, 2, 1.0 / 3}, .voxel_size = 0.1, .up = UpAxis::z},
                                ColourFormat::rgb888, 20000),
                {.ascii = true});
}

TEST(Export, FarFromTheOriginEveryCentreFallsIntoItsVoxelAgain) {
    const std::array<double, 3> far{8.5e6, -8412345.678901234, 123456.789};
    for (const double voxel : {1e-3, 1e-6, 8.5e6 * 0x1p-46})
        expect_same(colourful_model({.depth = 16, .origin = far, .voxel_size = voxel, .unit = Unit::metre}, //
                                    ColourFormat::rgb888, 20000),
                    {});
    expect_same(
        colourful_model({.depth = 5, .origin = {-1e30, 1e29, 0}, .voxel_size = 1e20}, ColourFormat::rgb888, 500), {});
    expect_same(colourful_model({.depth = 16, .origin = {0, 0, 0}, .voxel_size = 1e-30}, ColourFormat::rgb888, 500),
                {});
}

TEST(Export, VoxelsFinerThanTheNumbersAreRefused) {
    const Grid grid{.depth = 6, .origin = {8.5e6, 0, 0}, .voxel_size = 1e-9};
    const Bytes file = file_of(colourful_model(grid, ColourFormat::rgb888, 10));
    const auto doubles = exported(file, {}, {.level = 6});
    ASSERT_FALSE(doubles.ok());
    EXPECT_EQ(doubles.error().code, ErrorCode::unsupported_feature);

    const Grid coarse{.depth = 6, .origin = {8.5e6, 0, 0}, .voxel_size = 1};
    const Bytes coarse_file = file_of(colourful_model(coarse, ColourFormat::rgb888, 10));
    const auto floats = exported(coarse_file, {.single_precision = true}, {.level = 6});
    ASSERT_FALSE(floats.ok());
    EXPECT_EQ(floats.error().code, ErrorCode::usage);
    EXPECT_TRUE(exported(coarse_file, {.single_precision = true}, {.level = 3}).ok()) << "voxels of 8, steps of 1";
    expect_same(colourful_model({.depth = 6, .origin = {8.5e6, 0, 0}, .voxel_size = 4}, ColourFormat::rgb888, 1000),
                {.single_precision = true});
}

TEST(Export, EveryLevelHasItsPointsInOrder) {
    const Model model =
        colourful_model({.depth = 7, .origin = {10, 20, 30}, .voxel_size = 0.5}, ColourFormat::rgb888, 30000);
    const Bytes file = file_of(model, {.chunk_points = 512}); // many chunks
    std::vector<MortonCode> codes{0};
    for (int level = 0; level <= 7; ++level) {
        const Level &expected = model.levels[static_cast<std::size_t>(level)];
        if (level > 0)
            codes = value_of(expand_level(codes, expected.masks, expected.points.size()));
        const auto ply = exported(file, {}, {.level = level, .threads = 2});
        ASSERT_TRUE(ply.ok()) << ply.error().message;
        const Result<Surface> points = read_surface(*ply, "", {});
        ASSERT_TRUE(points.ok()) << points.error().message;
        ASSERT_EQ(points->positions.size(), codes.size());
        const double voxel = model.parameters.grid.voxel_size_at(level);
        for (std::size_t i = 0; i < codes.size(); ++i) {
            const auto at = morton_decode(codes[i]);
            ASSERT_EQ(points->positions[i],
                      glm::dvec3(10 + (at[0] + 0.5) * voxel, 20 + (at[1] + 0.5) * voxel, 30 + (at[2] + 0.5) * voxel));
            ASSERT_EQ(points->colours[i], point_colour(expected.points.colours, i, ColourFormat::rgb888));
            ASSERT_EQ(points->two_sided[i] != 0, (expected.points.normals[i] & kTwoSidedBit) != 0);
            ASSERT_EQ(points->material_ids[i], expected.points.materials[i]);
        }
    }
}

TEST(Export, ThreadsAndMemoryDoNotChangeTheBytes) {
    const Bytes file = file_of(colourful_model({.depth = 8}, ColourFormat::rgb888, 50000), {.chunk_points = 512});
    const auto one = exported(file, {}, {.level = 8, .threads = 1});
    ASSERT_TRUE(one.ok());
    for (const std::uint64_t memory : {std::uint64_t{1} << 20, std::uint64_t{1} << 24, kDefaultMaxMemory}) {
        const auto other = exported(file, {}, {.level = 8, .threads = 5, .max_memory = memory});
        ASSERT_TRUE(other.ok()) << other.error().message;
        EXPECT_EQ(*other, *one);
    }
    const auto small = exported(file, {}, {.level = 8, .max_memory = 1 << 16});
    ASSERT_FALSE(small.ok());
    EXPECT_EQ(small.error().code, ErrorCode::memory);
}

TEST(Export, ADamagedChunkEndsTheStream) {
    const Model model = colourful_model({.depth = 6}, ColourFormat::rgb888, 5000);
    Bytes file = file_of(model, {.chunk_points = 512});
    Result<Reader> reader = Reader::open(file);
    ASSERT_TRUE(reader.ok());
    for (int level = 1; level <= 6; ++level) {
        const std::vector<ChunkEntry> chunks = value_of(reader->directory(level))->chunks;
        for (const ChunkEntry &chunk : chunks) {
            file[chunk.offset + chunk.stored_bytes / 2] ^= 0x10;
            const auto refused = exported(file, {}, {.level = 6});
            ASSERT_FALSE(refused.ok()) << "level " << level << " at " << chunk.offset;
            EXPECT_EQ(exit_code(refused.error().code), 3);
            EXPECT_GE(refused.error().offset, chunk.offset);
            file[chunk.offset + chunk.stored_bytes / 2] ^= 0x10;
        }
    }
    EXPECT_TRUE(exported(file, {}, {.level = 6}).ok());
}

TEST(Export, TheHeaderNamesGridUnitAndCredits) {
    const Model model = colourful_model(
        {.depth = 5, .origin = {0.1, -2, 8.5e6}, .voxel_size = 1.0 / 3, .unit = Unit::millimetre, .up = UpAxis::z},
        ColourFormat::rgb888, 100);
    const auto ply = exported(file_of(model), {.ascii = true}, {.level = 5});
    ASSERT_TRUE(ply.ok());
    const std::string text(ply->begin(), ply->end());
    for (const char *line :
         {"\ncomment name two lines\n", "\ncomment licence CC0\n", "\ncomment unit mm\n", "\ncomment up +z\n",
          "\ncomment grid origin 0.1 -2 8500000 voxel_size 0.3333333333333333 depth 5\n", "\nelement material 3\n",
          "\n0.1 0.3 0.33333334 1024 1 2 255 1 0 201\n", "\nproperty uchar shape\nproperty uchar tint\n"})
        EXPECT_NE(text.find(line), std::string::npos) << line;
}

TEST(Export, AModelOfTheDefaultMaterialNamesNone) {
    Model model = test::sphere_model(5, {});
    const auto ply = exported(file_of(model), {.ascii = true}, {.level = 5});
    ASSERT_TRUE(ply.ok());
    EXPECT_EQ(std::string(ply->begin(), ply->end()).find("material"), std::string::npos);
    EXPECT_EQ(std::string(ply->begin(), ply->end()).find("red"), std::string::npos);

    model.parameters.materials[0].ks = 0.5F; // a single material: exported without an index per point
    const auto shiny = exported(file_of(model), {}, {.level = 5});
    ASSERT_TRUE(shiny.ok());
    const Model again = built(*shiny, model.parameters.grid, ColourFormat::rgb888);
    EXPECT_EQ(again.parameters, model.parameters);
}

} // namespace
