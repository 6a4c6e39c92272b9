// Fields of built models: how values become stored numbers, and what voxels get of their samples. BVG.md 17
#include "pbm_build/fields/field_choice.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace pbm::test {
namespace {

using namespace build;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Points on a line, a voxel of 1 apart at depth 5 and far more at the ends, with values.
Surface points_with(const std::vector<std::pair<double, double>> &places_and_values) {
    Surface surface;
    for (const auto &[x, value] : places_and_values) {
        surface.positions.emplace_back(x, 0, 0);
        surface.field_values[0].push_back({value});
    }
    surface.field_units[0] = "dB";
    return surface;
}

BuildOptions with_field(const std::string &field) {
    BuildOptions options = at_depth(5);
    options.outliers = Outliers::keep;
    options.grid.voxel_size = 1;
    options.grid.depth.reset();
    options.fields = {value_of(parse_field(field))};
    return options;
}

// Values of the points of the finest level in the order of x; NaN: none.
std::vector<double> values_of(const Model &model, std::size_t number = 0) {
    const Field &field = model.parameters.fields[number];
    std::vector<double> values;
    for (std::size_t i = 0; i < model.levels.back().points.size(); ++i) {
        const std::uint32_t stored = stored_value(model.levels.back().fields[number], i, field.bytes);
        values.push_back(stored == 0 ? kNone : field.value(stored));
    }
    return values;
}

TEST(FieldOption, IsRead) {
    EXPECT_EQ(parse_field("intensity")->name, "intensity");
    const FieldRequest all = value_of(parse_field("gps time=1,2.5,max,8"));
    EXPECT_EQ(all.name, "gps time");
    EXPECT_EQ(*all.range, (std::array<double, 2>{1, 2.5}));
    EXPECT_EQ(all.average, FieldAverage::maximum);
    EXPECT_EQ(all.bits, 8);
    EXPECT_EQ(parse_field("i=0,8")->range, (std::array<double, 2>{0, 8}));
    EXPECT_EQ(parse_field("i=0,8,16")->bits, 16);
    EXPECT_EQ(parse_field("i,16,majority")->average, FieldAverage::majority);
    for (const char *text : {"", "=1,2", "i=1", "i=2,1", "i=a,b", "i,median", "i=1,2,3", "i=0,inf", "i,mean,max",
                             "i,8,16", "i=1,2,8,8", "i,"})
        EXPECT_FALSE(parse_field(text)) << text;
}

TEST(BuiltFields, WholeNumbersAreKeptAsTheyAre) {
    const Model model = built(points_with({{0, 100}, {5, 354}, {9, 101}}), with_field("i"));
    const Field &field = model.parameters.fields.front();
    EXPECT_EQ(field, (Field{.name = "i", .unit = "dB", .offset = 100, .scale = 1, .bytes = 1}));
    EXPECT_EQ(values_of(model), (std::vector<double>{100, 354, 101}));
    const Model wide = built(points_with({{0, -30000}, {5, 30000}, {9, 0}}), with_field("i"));
    EXPECT_EQ(wide.parameters.fields.front().bytes, 2);
    EXPECT_EQ(values_of(wide), (std::vector<double>{-30000, 30000, 0}));
}

TEST(BuiltFields, OtherNumbersDivideTheirRange) {
    const Model model = built(points_with({{0, 0.5}, {5, 1.5}, {9, 0.75}}), with_field("i"));
    EXPECT_EQ(model.parameters.fields.front().bytes, 2);
    const std::vector<double> values = values_of(model);
    EXPECT_EQ(values[0], 0.5);
    EXPECT_NEAR(values[1], 1.5, 1e-12);
    EXPECT_NEAR(values[2], 0.75, 1.0 / 65534);
    EXPECT_EQ(built(points_with({{0, 0.5}, {5, 1.5}}), with_field("i,8")).parameters.fields.front().scale, 1.0 / 254);
    EXPECT_EQ(values_of(built(points_with({{0, 0.1}, {5, 0.1}}), with_field("i"))), (std::vector<double>{0.1, 0.1}));
}

TEST(BuiltFields, AFieldWithoutAnyValueIsRefused) {
    EXPECT_EQ(refused(points_with({{0, kNone}, {5, kNone}}), with_field("i")).message,
              "--field i: no point has a value; leave this option out");
}

// As a reader leaves the usual fields behind those that were asked for: class, intensity, return number.
TEST(BuiltFields, UsualFieldsAreKeptWhereTheyVary) {
    Surface points = points_with({{0, 100}, {5, 354}, {9, 101}});
    points.field_values[1] = {{2}, {2}, {2}};
    points.field_values[2] = {{7}, {9}, {8}};
    points.field_units[2] = "dB";
    BuildOptions options = with_field("i");
    const Model model = built(points, options);
    ASSERT_EQ(model.parameters.fields.size(), 2U);
    EXPECT_EQ(model.parameters.fields[1],
              (Field{.name = "intensity", .unit = "dB", .offset = 7, .scale = 1, .bytes = 1}));
    EXPECT_EQ(values_of(model, 1), (std::vector<double>{7, 9, 8}));
    options.dropped_fields = {"classification"}; // the reader has then left the intensity one slot ahead
    points.field_values[1] = std::move(points.field_values[2]);
    points.field_values[2].clear();
    EXPECT_EQ(built(points, options).parameters.fields[1].name, "intensity");
    options.fields.resize(kMaxFields, options.fields.front()); // no room
    for (std::size_t i = 0; i < kMaxFields; ++i) {
        options.fields[i].name = std::to_string(i);
        points.field_values[i] = {{1}, {2}, {3}};
    }
    EXPECT_EQ(built(points, options).parameters.fields.size(), kMaxFields);
}

TEST(BuiltFields, OnlyUncolouredCloudsAreNamedSo) {
    const auto is_named = [](const Surface &surface, const BuildOptions &options) {
        return built(surface, options).metadata.find("\"uncoloured_cloud\":true") != std::string::npos;
    };
    Surface points = points_with({{0, 100}, {5, 354}, {9, 101}});
    BuildOptions options = with_field("i");
    EXPECT_TRUE(is_named(points, options));
    options.scene.given = {{"lights", "studio"}};
    EXPECT_FALSE(is_named(points, options));
    options.scene.given.clear();
    points.normals.assign(3, {0, 0, 1});
    EXPECT_FALSE(is_named(points, options));
    points.normals.clear();
    points.colours.assign(3, Rgb8{1, 2, 3});
    EXPECT_FALSE(is_named(points, options));
}

TEST(BuiltFields, LongNamesThatBeginAlikeAreRefused) {
    BuildOptions options = with_field(std::string(40, 'a') + "1");
    options.fields.push_back(value_of(parse_field(std::string(40, 'a') + "2")));
    Surface points = points_with({{0, 1}, {5, 2}});
    points.field_values[1] = points.field_values[0];
    EXPECT_NE(refused(points, options).message.find("the same first 32 bytes"), std::string::npos);
}

TEST(BuiltFields, MadePointsTakeTheirValuesFromThoseAround) {
    Surface sheet;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            sheet.positions.emplace_back(2 * x, 2 * y, 0);
            sheet.field_values[0].push_back({static_cast<double>(2 * x)});
            sheet.field_values[1].push_back({static_cast<double>(x < 20 ? 3 : 7)});
        }
    sheet.field_units[0] = sheet.field_units[1] = "";
    BuildOptions options = with_field("i");
    options.fields.push_back(value_of(parse_field("class")));
    options.upsample = 4;
    const Model model = built(sheet, options);
    ASSERT_GT(model.point_count(), 2U * 1600U); // most voxels of the sheet were empty
    const std::vector<double> means = values_of(model), classes = values_of(model, 1);
    EXPECT_NE(std::find(means.begin(), means.end(), 41), means.end()); // between those given, which are even
    for (std::size_t i = 0; i < means.size(); ++i) {
        EXPECT_GE(means[i], 0);
        EXPECT_EQ(classes[i], means[i] < 39 ? 3 : 7) << means[i];
    }
}

TEST(BuiltFields, ValuesOutsideTheRangeAreClampedAndCounted) {
    BuildStatistics said;
    const Model model = built(points_with({{0, -5}, {5, 3}, {9, 99}}), with_field("i=0,10"), &said);
    EXPECT_EQ(values_of(model), (std::vector<double>{0, 3, 10}));
    const auto line = std::find_if(said.attributes.begin(), said.attributes.end(),
                                   [](const AttributeReport &r) { return r.name == "field i"; });
    ASSERT_NE(line, said.attributes.end());
    EXPECT_NE(line->note.find("2 values outside clamped"), std::string::npos) << line->note;
}

TEST(BuiltFields, AVoxelHasTheMeanTheMajorityOrTheLargest) {
    const std::vector<std::pair<double, double>> samples{{0.1, 4}, {0.2, 4}, {0.3, 9}, {0.4, kNone}, {9, 1}};
    EXPECT_EQ(values_of(built(points_with(samples), with_field("i,mean"))).front(), 6); // 17 / 3
    EXPECT_EQ(values_of(built(points_with(samples), with_field("i,majority"))).front(), 4);
    EXPECT_EQ(values_of(built(points_with(samples), with_field("i,max"))).front(), 9);
    // Labels have the majority without being told; of equally frequent ones the lowest.
    const Model labels = built(points_with({{0.1, 9}, {0.2, 4}, {9, 1}}), with_field("class"));
    EXPECT_EQ(labels.parameters.fields.front().average, FieldAverage::majority);
    EXPECT_EQ(values_of(labels).front(), 4);
}

TEST(BuiltFields, ARangeThatNoNumberHoldsIsRefused) {
    const std::vector<std::pair<double, double>> samples{{0.1, -1.7e308}, {0.2, 1.7e308}};
    EXPECT_NE(refused(points_with(samples), with_field("i")).message.find("too far apart"), std::string::npos);
}

TEST(BuiltFields, OrderAndThreadsDoNotMatter) {
    std::vector<std::pair<double, double>> samples(5000);
    for (int i = 0; i < 5000; ++i)
        samples[static_cast<std::size_t>(i)] = {(i * 7919 % 5000) * 0.006, std::sin(i * 0.37) * 1e-3};
    BuildOptions options = with_field("i");
    options.threads = 1;
    const Bytes one = file_of(built(points_with(samples), options));
    std::reverse(samples.begin(), samples.end());
    options.threads = 4;
    EXPECT_EQ(file_of(built(points_with(samples), options)), one);
}

TEST(BuiltFields, TrianglesMixTheValuesOfTheirCorners) {
    Surface surface;
    surface.positions = {{0, 0, 0}, {30, 0, 0}, {0, 30, 0}};
    surface.triangles = {{0, 1, 2}};
    for (const double value : {0.0, 30.0, 0.0})
        surface.field_values[0].push_back({value});
    surface.field_units[0] = "";
    const auto by_place = [&](const std::string &option) {
        const Model model = built(surface, with_field(option));
        std::vector<MortonCode> codes{0};
        for (std::size_t level = 1; level < model.levels.size(); ++level)
            codes = value_of(expand_level(codes, model.levels[level].masks, 1 << 20));
        const std::vector<double> values = values_of(model);
        std::vector<std::pair<double, double>> found;
        for (std::size_t i = 0; i < codes.size(); ++i)
            found.emplace_back(model.parameters.grid.origin[0] + morton_decode(codes[i])[0] + 0.5, values[i]);
        return found;
    };
    for (const auto &[x, value] : by_place("i,mean"))
        EXPECT_NEAR(value, std::clamp(x, 0.0, 30.0), 1.01) << x; // the field is x
    for (const auto &[x, value] : by_place("i,majority"))
        EXPECT_TRUE(value == 0 || value == 30) << value;
}

TEST(BuiltFields, OrderOfCornersAtOnePlaceDoesNotMatter) {
    const auto with_order = [](std::array<unsigned, 3> corners) {
        Surface surface;
        surface.positions = {{0, 0, 0}, {0, 0, 0}, {30, 1, 0}};
        surface.triangles = {{corners[0], corners[1], corners[2]}};
        for (const double value : {3.0, 30.0, 0.0})
            surface.field_values[0].push_back({value});
        surface.field_units[0] = "";
        return file_of(built(surface, with_field("i,majority")));
    };
    EXPECT_EQ(with_order({0, 1, 2}), with_order({1, 0, 2}));
    EXPECT_EQ(with_order({0, 1, 2}), with_order({2, 1, 0}));
}

TEST(BuiltFields, OfSeveralInputsThoseWithoutItHaveNone) {
    Surface without;
    without.positions = {{20, 0, 0}, {25, 0, 0}};
    std::vector<Surface> surfaces{points_with({{0, 7}, {5, 8}}), without};
    const std::vector<double> values = values_of(built(std::move(surfaces), with_field("i")));
    ASSERT_EQ(values.size(), 4U);
    EXPECT_EQ(values[0], 7);
    EXPECT_EQ(std::count_if(values.begin(), values.end(), [](double v) { return std::isnan(v); }), 2);
    Surface named = without;
    named.offered_fields = {"time"};
    const Error error = refused({named}, with_field("i"));
    EXPECT_EQ(error.code, ErrorCode::usage);
    EXPECT_NE(error.message.find("there is time"), std::string::npos) << error.message;
}

} // namespace
} // namespace pbm::test
