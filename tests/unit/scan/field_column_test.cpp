// Which attributes of scans are kept as fields, in every format; points of classes that are left out.
#include "pbm_format/model/las_classes.h"
#include "pbm_scan/fields/field_column.h"
#include "unit/scan/e57_files.h"
#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pbm::test {
namespace {

using namespace build;

std::vector<double> values_of(const Surface &surface, std::size_t slot) {
    std::vector<double> values;
    for (const FieldValue &value : surface.field_values[slot])
        values.push_back(value.number);
    return values;
}

Surface with_fields(const std::string &file, const char *name, std::vector<std::string> fields,
                    const std::string &classes = "") {
    ReadOptions options{.fields = std::move(fields)};
    if (!classes.empty())
        options.dropped_classes = *parse_classes(classes);
    Result<Surface> surface = read(file, name, options);
    EXPECT_TRUE(surface) << (surface ? "" : surface.error().message);
    return surface ? std::move(*surface) : Surface();
}

TEST(Fields, NamesAreComparedAsPeopleWriteThem) {
    for (const char *name : {"intensity", "Intensity", "scalar_Intensity", "vertex.intensity", "las:intensity"})
        EXPECT_GT(likeness("intensity", name), 0) << name;
    EXPECT_GT(likeness("gps_time", "GPS Time"), 0);
    EXPECT_GT(likeness("gps_time", "scalar_GPS-time"), 0);
    EXPECT_GT(likeness("scalar_field_#2", "scalar_Scalar_field_#2"), 0); // CloudCompare's default name
    EXPECT_GT(likeness("a_b_c", "a,b=c"), 0);
    EXPECT_EQ(likeness("intensity", "intensity2"), 0);
    EXPECT_TRUE(is_label("Classification") && is_label("scalar_Point_Source_ID") && is_label("return number"));
    EXPECT_FALSE(is_label("intensity") || is_label("confidence"));
}

TEST(Fields, TheBestNameWins) {
    const std::string csv = "x,y,z,scalar_Amp,AMP,Amp,amp\n0,0,0,1,2,3,4\n1,0,0,1,2,3,4\n0,1,0,1,2,3,4\n";
    const Surface s = with_fields(csv, "scan.csv", {"Amp", "amp", "AMP", "scalar_Amp", "scalar_amp"});
    const std::vector<double> wanted{3, 4, 2, 1, 1};
    for (std::size_t slot = 0; slot < wanted.size(); ++slot)
        EXPECT_EQ(values_of(s, slot)[0], wanted[slot]) << slot;
    const Surface same = with_fields("x,y,z,a,a,a\n0,0,0,1,2,3\n1,0,0,1,2,3\n0,1,0,1,2,3\n", "scan.csv", {"a_3"});
    EXPECT_EQ(values_of(same, 0)[0], 3);
    EXPECT_EQ(report(same, "columns a, a_2").fate, Fate::dropped);
    std::vector<std::string> names{"a", "a", "a_2", "a"};
    make_distinct(names);
    EXPECT_EQ(names, (std::vector<std::string>{"a", "a_3", "a_2", "a_4"})); // a_2 is taken
    const Surface classes =
        with_fields("x,y,z,class,scalar_Classification\n0,0,0,2,1\n1,0,0,2,1\n0,1,0,2,2\n", "scan.csv", {}, "ground");
    EXPECT_EQ(classes.positions.size(), 2U);
    EXPECT_EQ(values_of(with_fields("x,y,z,i\n0,0,0,16777217\n", "scan.csv", {"i"}), 0)[0], 16777217);
}

TEST(Fields, ClassesHaveNumbersAndNames) {
    EXPECT_EQ(parse_classes("noise,2")->count(), 3U);
    EXPECT_TRUE((*parse_classes("noise,2"))[18]);
    EXPECT_TRUE((*parse_classes("Vegetation"))[4]);
    EXPECT_TRUE((*parse_classes("255"))[255]);
    EXPECT_EQ(list_of(*parse_classes("HIGH_vegetation,low noise,wire")), "5,7,13,14,16");
    EXPECT_EQ(list_of(*parse_classes("created,key_point")), "0,8");
    for (const char *list : {"", "256", "trees", "2,", "-1"})
        EXPECT_FALSE(parse_classes(list)) << list;
}

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property uchar scalar_Classification\nproperty float confidence\nproperty double time\n"
    "end_header\n0 0 0 2 0.5 1e9\n1 0 0 7 0.25 2e9\n0 1 0 2 nan 3e9\n0 0 1 6 1 4e9\n";

TEST(Fields, OfPly) {
    const Surface s = with_fields(kPly, "scan.ply", {"confidence", "classification", "time"});
    EXPECT_EQ(values_of(s, 1), (std::vector<double>{2, 7, 2, 6}));
    EXPECT_EQ(values_of(s, 2), (std::vector<double>{1e9, 2e9, 3e9, 4e9}));
    EXPECT_EQ(values_of(s, 0)[1], 0.25);
    EXPECT_TRUE(std::isnan(values_of(s, 0)[2]));
    EXPECT_EQ(report(s, "vertex.scalar_Classification").fate, Fate::kept);
    const Surface none = with_fields(kPly, "scan.ply", {});
    EXPECT_TRUE(values_of(none, 0).empty());
    EXPECT_EQ(report(none, "vertex.scalar_Classification").fate, Fate::dropped);
    EXPECT_EQ(none.offered_fields, (std::vector<std::string>{"scalar_Classification", "confidence", "time"}));
}

TEST(Fields, PointsOfAClassAreLeftOut) {
    const Surface s = with_fields(kPly, "scan.ply", {"time"}, "noise");
    EXPECT_EQ(s.positions.size(), 3U);
    EXPECT_EQ(values_of(s, 0), (std::vector<double>{1e9, 3e9, 4e9}));
    EXPECT_TRUE(s.field_values[kMaxFields].empty());
    EXPECT_EQ(report(s, "--drop-class").note, "1 point left out");
    ReadOptions all{.dropped_classes = *parse_classes("noise,ground,building")};
    EXPECT_FALSE(read(kPly, "scan.ply", all));
    const Surface bare = with_fields("0 0 0\n1 0 0\n0 1 0\n", "scan.xyz", {}, "noise");
    EXPECT_EQ(report(bare, "--drop-class").fate, Fate::dropped);
    EXPECT_FALSE(read("0 0 0\n1 0 0\n0 1 0\n", "scan.xyz",
                      {.strict = true, .dropped_classes = *parse_classes("noise"), .progress = {}}));
    // A class is a whole number.
    const Surface table = with_fields("x,y,z,Class\n0,0,0,2.5\n1,0,0,2\n0,1,0,\n", "scan.csv", {}, "ground");
    EXPECT_EQ(table.positions.size(), 2U);
    EXPECT_EQ(report(table, "column Class").note, "its classes, for --drop-class");
    // Nothing may be left of one of several inputs.
    all.is_one_of_several = true;
    const Result<Surface> none = read(kPly, "scan.ply", all);
    ASSERT_TRUE(none);
    EXPECT_TRUE(none->positions.empty());
}

TEST(Fields, OfTables) {
    const std::string csv = "x,y,z,intensity,Class,Amplitude\n0,0,0,1,2,0.5\n1,0,0,3,7,1.5\n0,1,0,5,2,2.5\n";
    const Surface s = with_fields(csv, "scan.csv", {"amplitude", "class", "intensity"});
    EXPECT_EQ(values_of(s, 0), (std::vector<double>{0.5, 1.5, 2.5}));
    EXPECT_EQ(values_of(s, 1), (std::vector<double>{2, 7, 2}));
    EXPECT_EQ(values_of(s, 2), (std::vector<double>{1, 3, 5}));
    EXPECT_TRUE(s.colours.empty()); // shown by height, or by the field
    EXPECT_EQ(report(s, "columns intensity").fate, Fate::kept);
}

TEST(Fields, OfPcd) {
    const std::string pcd = "VERSION 0.7\nFIELDS x y z label ring\nSIZE 4 4 4 4 2\nTYPE F F F U U\nCOUNT 1 1 1 1 1\n"
                            "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n0 0 0 4 11\n1 2 3 5 12\n";
    const Surface s = with_fields(pcd, "scan.pcd", {"ring", "label"});
    EXPECT_EQ(values_of(s, 0), (std::vector<double>{11, 12}));
    EXPECT_EQ(values_of(s, 1), (std::vector<double>{4, 5}));
}

TEST(Fields, OfPtx) {
    const std::string ptx = "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
                            "1 0 0 0.5\n0 0 0 0\n1 1 0 0.75\n1 0 1 1\n";
    EXPECT_EQ(values_of(with_fields(ptx, "scan.ptx", {"intensity"}), 0), (std::vector<double>{0.5, 0.75, 1}));
}

// In every format of laser scans: a field of its usual name where nobody asks, and greys where it is none.
TEST(Fields, IntensitiesAreKeptUnasked) {
    const std::string pcd = "VERSION 0.7\nFIELDS x y z Intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
                            "WIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n0 0 0 1\n1 0 0 2\n0 1 0 5\n";
    const std::string ptx = "3\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
                            "9 0 0 1\n1 2 0 2\n1 0 7 5\n";
    const std::vector<double> x{0, 1, 2}, y{0, 0, 1}, z{0, 1, 0};
    const E57ScanText scan{{e57_floats("cartesianX", x), e57_floats("cartesianY", y), e57_floats("cartesianZ", z),
                            e57_floats("intensity", std::vector<float>{1, 2, 5})}};
    const std::vector<std::pair<std::string, const char *>> files{
        {"x,y,z,intensity\n0,0,0,1\n1,0,0,2\n0,1,0,5\n", "scan.csv"},
        {"x,y,z,scalar_Intensity\n0,0,0,1\n1,0,0,2\n0,1,0,5\n", "scan.csv"},
        {pcd, "scan.pcd"},
        {ptx, "scan.ptx"},
        {e57_file({scan}), "scan.e57"}};
    for (const auto &[file, name] : files) {
        const Result<Surface> kept = read(file, name, {.usual_fields = {"classification", "intensity"}});
        ASSERT_TRUE(kept) << kept.error().message;
        EXPECT_TRUE(kept->colours.empty()) << name;
        EXPECT_EQ(values_of(*kept, 1), (std::vector<double>{1, 2, 5})) << name;
        EXPECT_EQ(with_fields(file, name, {}).colours,
                  (std::vector{Rgb8{0, 0, 0}, Rgb8{255, 255, 255}, Rgb8{255, 255, 255}}))
            << name;
    }
}

TEST(Fields, OfPlyCloudsAreKeptUnaskedAndOfMeshesAreNot) {
    const std::string vertices = "0 0 0 1\n1 0 0 2\n0 1 0 5\n";
    const std::string header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                               "property float z\nproperty float scalar_Intensity\n";
    const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
    const ReadOptions options{.usual_fields = {"classification", "intensity"}};
    const Result<Surface> cloud = read(header + "end_header\n" + vertices, "scan.ply", options);
    ASSERT_TRUE(cloud) << cloud.error().message;
    EXPECT_EQ(values_of(*cloud, 1), (std::vector<double>{1, 2, 5}));
    const Result<Surface> mesh = read(header + faces + "end_header\n" + vertices + "3 0 1 2\n", "scan.ply", options);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(mesh->field_values[1].empty());
    EXPECT_EQ(report(*mesh, "vertex.scalar_Intensity").fate, Fate::dropped);
}

TEST(Fields, OfE57) {
    const std::vector<double> x{0, 1, 2}, y{0, 0, 1}, z{0, 1, 0};
    const E57ScanText scan{{e57_floats("cartesianX", x), e57_floats("cartesianY", y), e57_floats("cartesianZ", z),
                            e57_floats("intensity", std::vector<float>{1, 2, 3}),
                            e57_integers("returnIndex", 0, 7, {4, 5, 6}),
                            e57_floats("ext:confidence", std::vector<float>{0.5F, 0.25F, 1})}};
    const Surface s = with_fields(e57_file({scan}), "scan.e57", {"confidence", "returnIndex", "intensity"});
    EXPECT_EQ(values_of(s, 0), (std::vector<double>{0.5, 0.25, 1}));
    EXPECT_EQ(values_of(s, 1), (std::vector<double>{4, 5, 6}));
    EXPECT_EQ(values_of(s, 2), (std::vector<double>{1, 2, 3}));
    EXPECT_EQ(report(s, "returnIndex").fate, Fate::kept);
}

} // namespace
} // namespace pbm::test
