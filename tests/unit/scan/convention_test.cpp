// What formats and coordinate reference systems say of axes and units, and points that stand for no measurement.
#include "pbm_scan/conventions/convention.h"

#include "pbm_scan/conventions/geotiff_keys.h"
#include "pbm_scan/surface/placeholders.h"
#include "unit/scan/readings.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

const std::string kUtm =
    "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\",DATUM[\"x\",SPHEROID[\"GRS 1980\",6378137,298.257222101]],"
    "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],"
    "UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],AXIS[\"E\",EAST],AUTHORITY[\"EPSG\",\"25832\"]]";

TEST(Crs, WktTellsKindAndUnit) {
    EXPECT_EQ(facts_of(kUtm).kind, CrsKind::projected);
    EXPECT_EQ(facts_of(kUtm).metres, 1);
    const std::string feet =
        "COMPD_CS[\"a\",PROJCS[\"b\",GEOGCS[\"c\",UNIT[\"degree\",0.017]],UNIT[\"US survey foot\",0.304800609601219]],"
        "VERT_CS[\"d\",VERT_DATUM[\"e\",2005],UNIT[\"metre\",1]]]";
    EXPECT_EQ(unit_of_metres(facts_of(feet).metres), Unit::foot);
    EXPECT_EQ(unit_name(facts_of(feet).metres), "US survey foot");
    EXPECT_EQ(facts_of(feet).height_metres, 1);
    const std::string second = "PROJCRS[\"a\",BASEGEOGCRS[\"b\",ANGLEUNIT[\"degree\",0.017]],CS[Cartesian,2],"
                               "AXIS[\"E\",east,LENGTHUNIT[\"foot\",0.3048]],ID[\"EPSG\",2263]]";
    EXPECT_EQ(facts_of(second).metres, 0.3048);
    EXPECT_EQ(short_crs(second), "a (EPSG:2263)");
    EXPECT_EQ(facts_of("GEOGCS[\"WGS 84\",UNIT[\"degree\",0.017]]").kind, CrsKind::geographic);
    EXPECT_EQ(facts_of("GEODCRS[\"WGS 84\",CS[ellipsoidal,3],AXIS[\"h\",up,LENGTHUNIT[\"metre\",1]]]").kind,
              CrsKind::geographic);
    EXPECT_EQ(facts_of("GEODCRS[\"WGS 84\",CS[Cartesian,3],LENGTHUNIT[\"metre\",1]]").kind, CrsKind::geocentric);
    EXPECT_EQ(facts_of("EPSG:25832").metres, 1);
    for (const std::string_view damaged : {"", "PROJCS", "]]]", "PROJCS[\"a", "a[[[[", "\"", "EPSG:", "EPSG:x"})
        EXPECT_EQ(facts_of(damaged).metres, 0) << damaged;
    for (std::size_t size = 0; size < kUtm.size(); ++size)
        facts_of(std::string_view(kUtm).substr(0, size));
}

Bytes words(std::initializer_list<int> values) {
    Bytes bytes;
    for (const int value : values) {
        bytes.push_back(static_cast<std::uint8_t>(value & 255));
        bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    }
    return bytes;
}

TEST(Crs, GeotiffKeysBecomeAText) {
    const Bytes keys = words({1, 1, 0, 4, 1024, 0, 1, 1, 3072, 0, 1, 2263, 3073, 34737, 9, 4, 3076, 0, 1, 9003});
    const std::string texts = "abc|New York|";
    const GeotiffRecords records{keys, {}, bytes_of(texts)};
    const GeotiffCrs crs = read_geotiff(records);
    EXPECT_EQ(crs.text, "EPSG:2263 (New York); unit US survey foot (EPSG:9003)");
    EXPECT_EQ(crs.facts.kind, CrsKind::projected);
    EXPECT_EQ(unit_of_metres(crs.facts.metres), Unit::foot);
    for (std::size_t size = 0; size < keys.size(); ++size)
        read_geotiff({ByteView(keys).first(size), {}, {}});
    EXPECT_EQ(read_geotiff({words({1, 1, 0, 1, 2048, 0, 1, 4326}), {}, {}}).facts.kind, CrsKind::geographic);
    EXPECT_EQ(read_geotiff({}).text, "");
}

TEST(Convention, FormatsSayTheAxisAndTheUnit) {
    const std::string row = "1 2 3\n";
    EXPECT_EQ(surface(row, "scan.pts").convention.up, UpAxis::z);
    EXPECT_EQ(surface(row, "scan.pts").convention.unit, Unit::metre);
    EXPECT_EQ(surface(row, "scan.xyz").convention.up, std::nullopt);
    Surface gltf;
    apply_convention("gltf", ".glb", gltf);
    EXPECT_EQ(gltf.convention.up, UpAxis::y);
    EXPECT_FALSE(gltf.convention.is_firm);
    EXPECT_EQ(gltf.convention.unit, Unit::metre);
    gltf.convention = {};
    gltf.positions = {{500000, 4100000, 100}, {500030, 4100030, 110}};
    apply_convention("gltf", ".glb", gltf);
    EXPECT_EQ(gltf.convention.up, UpAxis::z); // like a map
    EXPECT_TRUE(gltf.convention.is_firm);
    Surface las;
    las.crs = kUtm;
    apply_convention("las", ".las", las);
    EXPECT_EQ(las.convention.up, UpAxis::z);
    EXPECT_EQ(las.convention.unit, Unit::metre);
    las.positions = gltf.positions;
    std::vector<Surface> both(2);
    both[0] = las;
    both[1] = gltf;
    both[1].convention.up = UpAxis::y;
    EXPECT_EQ(common_convention(both).up, std::nullopt);
    EXPECT_EQ(common_convention(both).unit, Unit::metre);
}

// A degree of longitude has 76,057 m at 47 degrees on this ellipsoid, one of latitude 111,185 m.
TEST(Geographic, DegreesBecomeMetresAtTheirCentre) {
    const std::string rows = "8.5 47 400\n8.6 47 400\n8.5 47.1 400\n8.6 47.1 410\n";
    for (const Surface &s : {surface("lon lat height\n" + rows, "scan.txt"),
                             surface(rows, "scan.xyz", {.is_geographic = true, .progress = {}})}) {
        ASSERT_EQ(s.positions.size(), 4U);
        EXPECT_NEAR(glm::distance(s.positions[0], s.positions[1]), 7605.7, 1.5);
        EXPECT_NEAR(glm::distance(s.positions[0], s.positions[2]), 11118.5, 1.5);
        EXPECT_NEAR(s.positions[0].z, 400 - 3.55, 0.2); // 6.73 km from the centre
        EXPECT_EQ(s.convention.unit, Unit::metre);
        EXPECT_EQ(s.convention.up, UpAxis::z);
        EXPECT_TRUE(has(s.crs, "longitude 8.55, latitude 47.05"));
        EXPECT_TRUE(reports(s, "degrees", Fate::converted));
    }
    const Surface none = surface("lon lat height\n800 47 400\n", "scan.txt");
    EXPECT_EQ(none.positions[0], glm::dvec3(800, 47, 400));
    EXPECT_FALSE(read("lon lat height\n" + rows, "scan.txt", {.is_one_of_several = true}).ok());
    const Surface bare = surface("8.5 47 400\n8.51 47.01 440\n", "scan.xyz");
    EXPECT_TRUE(has(report(bare, "x and y").note, "--geographic"));
    EXPECT_EQ(report(surface("8.5 47 1\n8.51 47.01 1.2\n", "scan.xyz"), "x and y").name, "");
}

TEST(Placeholders, OfRaysWithoutAnEchoAreLeftOut) {
    std::string text;
    for (int i = 0; i < 200; ++i)
        text +=
            std::to_string(500000 + i % 17) + " " + std::to_string(4100000 + i % 13) + " " + std::to_string(i) + "\n";
    const Surface far = surface(text + "0 0 0\n", "scan.xyz");
    EXPECT_EQ(far.positions.size(), 200U);
    EXPECT_TRUE(has(report(far, "placeholders").note, "1 point at 0 0 0"));
    EXPECT_EQ(surface(text + "500001 4100001 -9999\n", "scan.xyz").positions.size(), 200U);
    EXPECT_EQ(surface(text + "1e10 1e10 1e10\n", "scan.xyz").positions.size(), 200U);
    EXPECT_EQ(surface(text + "0 0 0\n", "scan.xyz", {.keep_placeholders = true, .progress = {}}).positions.size(),
              201U);
    std::string around, zeros;
    for (int i = 0; i < 200; ++i) {
        around += std::to_string(i % 20 - 10) + " " + std::to_string(i / 10 - 10) + " " + std::to_string(i % 7) + "\n";
        zeros += "0 0 0\n";
    }
    EXPECT_EQ(surface(around + zeros, "scan.xyz").positions.size(), 200U);
    EXPECT_EQ(surface(around + "0 0 0\n0 0 0\n", "scan.xyz").positions.size(), 202U); // two points at the origin
    std::string copies;
    for (int i = 0; i < 40; ++i)
        copies += around.substr(0, around.find('\n', around.size() / 2) + 1) + "0 0 0\n";
    EXPECT_EQ(report(surface(copies, "scan.xyz"), "placeholders").name, ""); // all points are there 40 times
    const Surface mesh =
        surface("v 0 0 0\nv 9000000 0 1\nv 9000000 1 0\nv 9000001 1 0\nf 1 2 3\nf 2 3 4\n", "scan.obj");
    EXPECT_EQ(mesh.positions.size(), 4U);
}

} // namespace
