// Parts of a model: which voxels belong to which, how they become one, and their files.
#include "built_models.h"
#include "pbm_build/parts/part_file.h"
#include "small_meshes.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <unistd.h>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

// The ranges of all parts of a scan without attributes.
std::vector<BucketRange> ranges_of(const Surface &surface, const Grid &grid, std::uint64_t count) {
    const VertexNormals normals{};
    const Bytes radii;
    const SurfaceSampler sampler(surface, {}, normals, radii, {}, grid, 2);
    std::vector<BucketRange> ranges;
    for (std::uint64_t i = 0; i < count; ++i)
        ranges.push_back(buckets_of_part(sampler, {i, count}, grid.depth));
    return ranges;
}

void expect_all_buckets_once(std::span<const BucketRange> ranges, std::size_t buckets) {
    std::size_t next = 0;
    for (const BucketRange &range : ranges) {
        EXPECT_EQ(range.first, next);
        EXPECT_LE(range.first, range.last);
        next = range.last;
    }
    EXPECT_EQ(next, buckets);
}

std::size_t bucket_count(int depth) { return std::size_t{1} << 3 * HitStore::bucket_level(depth); }

// `edge`^3 points without faces, evenly spaced in a cube of edge 256.
Surface lattice_of_points(int edge) {
    Surface surface;
    const double step = 256.0 / edge;
    for (int i = 0; i < edge * edge * edge; ++i)
        surface.positions.push_back(step * (glm::dvec3(i % edge, i / edge % edge, i / edge / edge) + 0.5));
    return surface;
}

const Grid kGrid{.depth = 8};

TEST(BucketRanges, AllPartsTogetherHaveAllBucketsOnceInAscendingOrder) {
    const Surface points = lattice_of_points(20);
    for (const unsigned count : {1U, 2U, 3U, 7U, 64U, 511U, 512U, 513U, 1000U})
        expect_all_buckets_once(ranges_of(points, kGrid, count), bucket_count(kGrid.depth));
    for (const int depth : {kMinDepth, 5, 6, 10}) {
        Grid grid{.depth = depth};
        grid.voxel_size = 256 / static_cast<double>(1 << depth);
        expect_all_buckets_once(ranges_of(points, grid, 5), bucket_count(depth));
    }
}

TEST(BucketRanges, PartsOfAnEvenScanHaveEquallyManyOfItsSources) {
    const Surface points = lattice_of_points(32); // in all 512 buckets
    for (const std::size_t count : {2U, 4U, 8U, 13U}) {
        const std::size_t even = bucket_count(kGrid.depth) / count;
        for (const BucketRange &range : ranges_of(points, kGrid, count)) {
            EXPECT_GE(range.last - range.first, even);
            EXPECT_LE(range.last - range.first, even + 1);
        }
    }
}

TEST(BucketRanges, TwoCrowdedBucketsAreOfTwoParts) {
    Surface points;
    points.positions = {{0.5, 0.5, 0.5}, {255.5, 255.5, 255.5}};
    const std::vector<BucketRange> ranges = ranges_of(points, kGrid, 2);
    expect_all_buckets_once(ranges, bucket_count(kGrid.depth));
    EXPECT_TRUE(ranges[0].holds(0));
    EXPECT_TRUE(ranges[1].holds(bucket_count(kGrid.depth) - 1));
}

TEST(BucketRanges, OneCrowdedBucketLeavesOtherPartsEmpty) {
    Surface points;
    for (int i = 0; i < 100; ++i)
        points.positions.emplace_back(100.5, 100.5, 100.5);
    const std::size_t crowded = static_cast<std::size_t>(morton_encode(100, 100, 100) >> HitStore::kBlockBits);
    const std::vector<BucketRange> ranges = ranges_of(points, kGrid, 6);
    expect_all_buckets_once(ranges, bucket_count(kGrid.depth));
    EXPECT_EQ(std::count_if(ranges.begin(), ranges.end(), [&](const auto &range) { return range.holds(crowded); }), 1);
}

// Points at every third address from `first` on, whose attributes are numbers of the points.
Part numbered_part(MortonCode first, std::size_t points, const AttributeSet &set, std::vector<Field> fields) {
    Part part;
    part.parameters.grid = {.depth = 8, .origin = {1, -2, 3.5}, .voxel_size = 0.1, .unit = Unit::millimetre};
    part.parameters.attributes = set;
    part.parameters.materials.resize(set.material ? 2 : 1);
    part.parameters.materials.back().ks = 0.5F;
    part.parameters.fields = std::move(fields);
    part.metadata = R"({"generator":"a test"})";
    part.has_points = true;
    part.statistics.report("vertex.\xff", Fate::dropped, "no reason", "scan.ply");
    part.statistics.input_bytes = 5;
    part.statistics.vertices = 6;
    part.statistics.triangles = 7;
    part.statistics.samples = 3 * points;
    part.statistics.made_points = 9;
    Voxels &voxels = part.voxels;
    for (std::size_t i = 0; i < points; ++i)
        voxels.codes.push_back(first + 3 * i);
    std::size_t stream = 0;
    for_columns(
        set,
        [&](const StreamInfo &, std::size_t width, auto &column) {
            for (std::size_t i = 0; i < points * width; ++i)
                column.push_back(static_cast<std::uint8_t>(31 * ++stream + first));
        },
        voxels.points);
    for (std::uint8_t &material : voxels.points.materials)
        material %= 2;
    for (std::size_t f = 0; f < part.parameters.fields.size(); ++f)
        voxels.fields.emplace_back(points * part.parameters.fields[f].bytes, static_cast<std::uint8_t>(f + first));
    if (points > 2)
        voxels.made = {voxels.codes[0], voxels.codes[2]};
    for (std::size_t i = 0; i < points; ++i)
        voxels.offsets.push_back(i % 3 == 0 ? kNoOffset : static_cast<std::int8_t>(static_cast<int>(i % 29) - 14));
    for (std::size_t i = 1; i < points; i += 4) {
        voxels.sides.codes.push_back(voxels.codes[i]);
        voxels.sides.values.resize(2 * voxels.sides.codes.size(), set);
        voxels.sides.values.radii.clear();
        voxels.sides.values.normals.back() = static_cast<std::uint16_t>(i);
    }
    return part;
}

std::vector<Field> two_fields() {
    Field mean, vote;
    mean.name = "intensity";
    mean.bytes = 2;
    vote.name = "classification";
    vote.average = FieldAverage::majority;
    return {mean, vote};
}

void expect_same(const Voxels &a, const Voxels &b) {
    EXPECT_EQ(a.codes, b.codes);
    EXPECT_EQ(a.points, b.points);
    EXPECT_EQ(a.fields, b.fields);
    EXPECT_EQ(a.made, b.made);
    EXPECT_EQ(a.offsets, b.offsets);
    EXPECT_EQ(a.sides.codes, b.sides.codes);
    EXPECT_EQ(a.sides.values, b.sides.values);
}

TEST(Parts, JoinedPartsAreTheWhole) {
    const AttributeSet set{.colour = ColourFormat::rgb888, .material = true};
    const Part whole = numbered_part(1, 30, set, two_fields());
    const auto piece = [&](std::size_t first, std::size_t last) {
        Part part = numbered_part(1, 0, set, two_fields());
        const auto cut = [&](const auto &from, auto &to, std::size_t width) {
            to.assign(from.begin() + static_cast<std::ptrdiff_t>(first * width),
                      from.begin() + static_cast<std::ptrdiff_t>(last * width));
        };
        cut(whole.voxels.codes, part.voxels.codes, 1);
        cut(whole.voxels.offsets, part.voxels.offsets, 1);
        for_columns(
            set, [&](const StreamInfo &, std::size_t width, const auto &from, auto &to) { cut(from, to, width); },
            whole.voxels.points, part.voxels.points);
        for (std::size_t f = 0; f < whole.voxels.fields.size(); ++f)
            cut(whole.voxels.fields[f], part.voxels.fields[f], whole.parameters.fields[f].bytes);
        VoxelSides &sides = part.voxels.sides;
        for (std::size_t i = 0; i < whole.voxels.sides.codes.size(); ++i) {
            const MortonCode code = whole.voxels.sides.codes[i];
            if (!std::binary_search(part.voxels.codes.begin(), part.voxels.codes.end(), code))
                continue;
            sides.codes.push_back(code);
            sides.values.resize(2 * sides.codes.size(), set);
            sides.values.radii.clear();
            sides.values.normals.back() = whole.voxels.sides.values.normals[2 * i + 1];
        }
        for (const MortonCode made : whole.voxels.made)
            if (std::binary_search(part.voxels.codes.begin(), part.voxels.codes.end(), made))
                part.voxels.made.push_back(made);
        part.statistics.samples = last - first;
        return part;
    };
    for (const auto &ends : {std::vector<std::size_t>{0, 30}, {0, 0, 2, 30, 30}, {0, 1, 15, 30}}) {
        std::vector<Part> parts;
        for (std::size_t i = 1; i < ends.size(); ++i)
            parts.push_back(piece(ends[i - 1], ends[i]));
        const Part joined = join(std::move(parts));
        expect_same(joined.voxels, whole.voxels);
        EXPECT_EQ(joined.parameters, whole.parameters);
        EXPECT_EQ(joined.statistics.samples, 30U);
        EXPECT_EQ(joined.statistics.made_points, 9U);
    }
}

// A file in a folder that is removed with it.
class PartFile : public testing::Test {
  protected:
    PartFile() { std::filesystem::create_directories(folder_); }
    ~PartFile() override { std::filesystem::remove_all(folder_); }
    PartFile(const PartFile &) = delete;
    PartFile &operator=(const PartFile &) = delete;

    Bytes bytes() const {
        std::ifstream file(path_, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    void put(ByteView bytes) const {
        std::filesystem::remove(path_); // to truncate a file is slow
        std::ofstream(path_, std::ios::binary)
            .write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
    void expect_round_trip(const Part &part) const {
        ASSERT_TRUE(write_part(path_, kName, part).ok());
        const Result<Part> read = read_part(path_, kName);
        ASSERT_TRUE(read.ok()) << read.error().message;
        expect_same(read->voxels, part.voxels);
        EXPECT_EQ(read->parameters, part.parameters);
        EXPECT_EQ(read->metadata, part.metadata);
        EXPECT_EQ(read->has_points, part.has_points);
        const BuildStatistics &said = read->statistics, &say = part.statistics;
        EXPECT_EQ(said.input_bytes, say.input_bytes);
        EXPECT_EQ(said.vertices, say.vertices);
        EXPECT_EQ(said.triangles, say.triangles);
        EXPECT_EQ(said.samples, say.samples);
        EXPECT_EQ(said.made_points, say.made_points);
        ASSERT_EQ(said.attributes.size(), say.attributes.size());
        for (std::size_t i = 0; i < said.attributes.size(); ++i) {
            EXPECT_EQ(said.attributes[i].fate, say.attributes[i].fate);
            EXPECT_EQ(said.attributes[i].note, say.attributes[i].note);
            EXPECT_EQ(said.attributes[i].input, say.attributes[i].input);
        }
        const auto found = find_part(path_, kName);
        ASSERT_TRUE(found);
        EXPECT_EQ(found->points, part.voxels.codes.size());
        EXPECT_EQ(found->grid, part.parameters.grid);
    }
    // Neither merged nor kept.
    void expect_refused(const PartName &name, std::string_view text) const {
        const Result<Part> read = read_part(path_, name);
        ASSERT_FALSE(read.ok());
        EXPECT_EQ(read.error().code, ErrorCode::bad_input);
        EXPECT_NE(read.error().message.find(text), std::string::npos) << read.error().message;
        EXPECT_FALSE(find_part(path_, name));
    }

    const PartName kName{"0123abcd", {1, 4}};
    const std::filesystem::path folder_ =
        std::filesystem::path(testing::TempDir()) / ("pbm_parts_" + std::to_string(getpid()));
    const std::string path_ = part_file_name((folder_ / "whole.pbvg").string(), {1, 4});
};

TEST_F(PartFile, IsNamedAfterTheModel) {
    EXPECT_EQ(part_file_name("a/whole.pbvg", {0, 12}), "a/whole.pbvg.part-0-of-12");
}

TEST_F(PartFile, HoldsEveryAttribute) {
    for (const ColourFormat colour : {ColourFormat::none, ColourFormat::rgb565, ColourFormat::rgb888})
        for (const bool material : {false, true})
            for (const auto &fields : {std::vector<Field>{}, two_fields()})
                for (const std::size_t points : {0U, 1U, 2U, 1000U})
                    expect_round_trip(numbered_part(5, points, {.colour = colour, .material = material}, fields));
}

TEST_F(PartFile, HoldsMissingNormalsAndRadii) {
    Part part = numbered_part(0, 100, {}, {});
    part.parameters.closed = true;
    std::fill(part.voxels.points.normals.begin(), part.voxels.points.normals.end(), std::uint16_t{0xFFFF});
    std::fill(part.voxels.points.radii.begin(), part.voxels.points.radii.end(), std::uint8_t{0});
    part.has_points = false;
    part.voxels.made = {};
    expect_round_trip(part);
}

TEST_F(PartFile, OfAnotherBuildIsRefused) {
    ASSERT_TRUE(write_part(path_, kName, numbered_part(0, 10, {}, {})).ok());
    expect_refused({"0123abce", kName.number}, "another build");
    expect_refused({"", kName.number}, "another build");
    expect_refused({kName.key, {1, 5}}, "another build");
    expect_refused({kName.key, {2, 4}}, "another part");
}

TEST_F(PartFile, EveryFlippedBitAndEveryTruncationIsRefused) {
    ASSERT_TRUE(write_part(path_, kName, numbered_part(0, 10, {.colour = ColourFormat::rgb565}, two_fields())).ok());
    const Bytes whole = bytes();
    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
        Bytes flipped = whole;
        flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ 1U << bit % 8);
        put(flipped);
        expect_refused(kName, "damaged");
    }
    for (std::size_t size = 0; size < whole.size(); ++size) {
        put(ByteView(whole).first(size));
        expect_refused(kName, "damaged");
    }
    Bytes longer = whole;
    longer.push_back(0);
    put(longer);
    expect_refused(kName, "damaged");
    put(whole);
    EXPECT_TRUE(read_part(path_, kName).ok());
}

// Its hash is right: somebody made it.
TEST_F(PartFile, WithValuesThatNoBuildWritesIsRefused) {
    const auto expect_damaged = [&](const Part &part) {
        ASSERT_TRUE(write_part(path_, kName, part).ok());
        const Result<Part> read = read_part(path_, kName);
        ASSERT_FALSE(read.ok());
        EXPECT_NE(read.error().message.find("damaged"), std::string::npos) << read.error().message;
    };
    Part part = numbered_part(0, 10, {.material = true}, {});
    part.voxels.points.materials[3] = 2;
    expect_damaged(part);
    for (const int fate : {4, 255}) {
        part = numbered_part(0, 10, {}, {});
        part.statistics.report("", static_cast<Fate>(fate), "");
        expect_damaged(part);
    }
}

TEST_F(PartFile, ThatIsNotThereIsAnErrorOfTheSystem) {
    const Result<Part> read = read_part(path_, kName);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().code, ErrorCode::io);
    EXPECT_FALSE(find_part(path_, kName));
    EXPECT_FALSE(write_part((folder_ / "none" / "part").string(), kName, numbered_part(0, 1, {}, {})).ok());
}

} // namespace
