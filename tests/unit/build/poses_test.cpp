// Poses of scans, and alignment files.
#include "pbm_build/preparing/poses.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

namespace {

using namespace pbm;
using namespace pbm::build;

class Poses : public testing::Test {
  protected:
    Poses() { std::filesystem::create_directories(folder_); }
    ~Poses() override { std::filesystem::remove_all(folder_); }
    std::string write(const std::string &name, const std::string &text) const {
        std::ofstream(folder_ / name) << text;
        return (folder_ / name).string();
    }

  private:
    std::filesystem::path folder_ =
        std::filesystem::path(testing::TempDir()) / ("pbm_poses_" + std::to_string(::getpid()));
};

glm::dvec3 moved(const glm::dmat4 &matrix, const glm::dvec3 &p) { return glm::dvec3(matrix * glm::dvec4(p, 1)); }

TEST_F(Poses, MatricesMoveTurnAndScale) {
    // Turned by 90 degrees about z, twice as large, moved by 10 along x. Commas, comments and one line are read too.
    const std::string rows = write("rows.txt", "# from CloudCompare\n0 -2 0 10\n2 0 0 0\n0 0 2 0\n0 0 0 1\n");
    const std::string line = write("line.txt", "[0, -2, 0, 10, 2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]");
    for (const std::string &file : {rows, line}) {
        const auto scans = posed_scans(std::vector<std::string>{"a.ply"}, std::vector{file});
        ASSERT_TRUE(scans.ok()) << scans.error().message;
        Surface surface;
        surface.positions = {{1, 0, 0}};
        surface.normals = {{3, 0, 0}};
        surface.radii = {1};
        pose(surface, *scans->front().pose);
        EXPECT_EQ(surface.positions[0], glm::dvec3(10, 2, 0));
        EXPECT_EQ(surface.normals[0], glm::vec3(0, 1, 0));
        EXPECT_NEAR(surface.radii[0], 2, 1e-6);
    }
    Surface mirrored;
    mirrored.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mirrored.triangles = {{0, 1, 2}};
    pose(mirrored, glm::dmat4({-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}));
    EXPECT_EQ(mirrored.triangles[0], glm::uvec3(0, 2, 1));
}

TEST_F(Poses, AlignmentFilesNameScans) {
    write("front.ply", "ply");
    write("Back.PLY", "ply");
    // The inverse of a turn by 90 degrees about y.
    const std::string conf = write("both.conf", "camera 0 0 -1 0 1 0 0\nmesh scanner_cybcyl 0 0 0 0 0 0 1\n"
                                                "bmesh front.ply 0 0 0 0 0 0 1\n"
                                                "bmesh back.ply 1 2 3 0 0.70710678118654752 0 0.70710678118654752\n");
    const auto scans = posed_scans(std::vector{conf, std::string("other.ply")}, {});
    ASSERT_TRUE(scans.ok()) << scans.error().message;
    ASSERT_EQ(scans->size(), 3U);
    EXPECT_EQ(*(*scans)[0].pose, glm::dmat4(1));
    EXPECT_TRUE((*scans)[1].file.ends_with("/Back.PLY"));
    EXPECT_LT(glm::length(moved(*(*scans)[1].pose, {1, 0, 0}) - glm::dvec3(1, 2, 4)), 1e-12);
    EXPECT_FALSE((*scans)[2].pose);
    const auto named = scans_of_alignment(conf);
    ASSERT_EQ(named.size(), 3U);
    EXPECT_EQ(named[0].name, "scanner_cybcyl");
    EXPECT_EQ(named[0].file, "");
    EXPECT_TRUE(named[2].file.ends_with("/Back.PLY") && named[2].place.ends_with("/back.ply"));
    EXPECT_TRUE(scans_of_alignment(write("x.ply", "ply\n")).empty());
}

TEST_F(Poses, WhatMakesNoSenseIsRefused) {
    const auto refusal = [](const std::vector<std::string> &inputs, const std::vector<std::string> &poses) {
        const auto scans = posed_scans(inputs, poses);
        EXPECT_FALSE(scans.ok());
        return scans.ok() ? std::string() : scans.error().message;
    };
    const auto has = [](const std::string &text, const char *part) { return text.find(part) != std::string::npos; };
    const std::string scan = write("a.ply", "ply"), good = write("good", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1");
    EXPECT_TRUE(has(refusal({scan, scan}, {good}), "1 poses for 2 inputs"));
    EXPECT_TRUE(has(refusal({scan}, {write("few", "1 0 0 0")}), "has 4 numbers"));
    EXPECT_TRUE(has(refusal({scan}, {write("words", "1 0 0 x")}), "'x' is not a number"));
    EXPECT_TRUE(has(refusal({scan}, {write("column", "1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1")}), "column by column"));
    EXPECT_TRUE(has(refusal({scan}, {write("flat", "1 0 0 0 0 1 0 0 0 0 0 0 0 0 0 1")}), "flat"));
    EXPECT_TRUE(has(refusal({scan}, {"/no/such/file"}), "/no/such/file: cannot open"));
    EXPECT_TRUE(has(refusal({write("a.conf", "bmesh a.ply 0 0 0 0 0 0 1")}, {good}), "leave --pose out"));
    EXPECT_TRUE(has(refusal({write("b.conf", "camera 0\nbmesh none.ply 0 0 0 0 0 0 1")}, {}),
                    "b.conf: line 2: there is no file 'none.ply' beside it"));
    EXPECT_TRUE(has(refusal({write("c.conf", "bmesh a.ply 0 0 0 0 0 0")}, {}), "a quaternion (4)"));
    EXPECT_TRUE(has(refusal({write("d.conf", "bmesh a.ply 0 0 0 0 0 0 0")}, {}), "a quaternion (4)"));
    EXPECT_TRUE(has(refusal({write("e.conf", "camera 0\n")}, {}), "names no scan"));
    const auto table = posed_scans(std::vector{write("table.csv", "camera x y z\n0 1 2 3\n")}, {});
    ASSERT_TRUE(table.ok()); // a table of points
    EXPECT_EQ(table->size(), 1U);
    EXPECT_TRUE(has(refusal({write("f.conf", "camera 0\nlens 1\n")}, {}), "'lens' begins no line"));
}

} // namespace
