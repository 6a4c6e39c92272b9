// Scans of points: terrain and statue.
#include "pbm-sample/noise/deterministic_math.h"
#include "pbm-sample/ply/ply_stream.h"
#include "pbm-sample/points/statue.h"
#include "pbm-sample/points/statue_shape.h"
#include "pbm-sample/points/sweeps.h"
#include "pbm-sample/points/terrain.h"

#include "pbm_format/hashes/hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <vector>

namespace pbm::sample {
namespace {

using Make = PointScan (*)(std::uint64_t points, std::uint32_t seed);
constexpr Make kShapes[] = {make_terrain, make_statue};

Bytes file_of(const PointScan &scan, const PointPlyOptions &options, std::size_t *largest_block = nullptr) {
    Bytes file;
    const Status status = stream_ply(scan, options, [&](ByteView bytes) -> Status {
        file.insert(file.end(), bytes.begin(), bytes.end());
        if (largest_block != nullptr)
            *largest_block = std::max(*largest_block, bytes.size());
        return {};
    });
    EXPECT_TRUE(status);
    return file;
}

std::vector<ScanPoint> points_of(const PointScan &scan, std::uint64_t first, std::size_t count) {
    std::vector<ScanPoint> points(count);
    scan.fill(first, points);
    return points;
}

// The same for every compiler and machine.
TEST(PointScans, HaveTheirGoldenBytes) {
    const PointPlyOptions options{.normals = true, .comment = "golden", .threads = 2};
    EXPECT_EQ(hash64(file_of(make_terrain(20000, 1), options)), 15416143715421294473U);
    EXPECT_EQ(hash64(file_of(make_statue(20000, 1), options)), 6264545080984568170U);
}

TEST(PointScans, DoNotDependOnTheNumberOfThreads) {
    for (const Make make : kShapes)
        for (const PlyEncoding encoding : {PlyEncoding::binary_little_endian, PlyEncoding::ascii}) {
            const PointScan scan = make(50001, 3);
            const Bytes one = file_of(scan, {.encoding = encoding, .comment = "threads", .threads = 1});
            EXPECT_EQ(one, file_of(scan, {.encoding = encoding, .comment = "threads", .threads = 2}));
            EXPECT_EQ(one, file_of(scan, {.encoding = encoding, .comment = "threads", .threads = 5}));
        }
}

TEST(PointScans, HaveTheExactNumberOfPoints) {
    for (const Make make : kShapes)
        for (const std::uint64_t points : {1U, 2U, 7U, 100U, 4095U, 4096U, 4097U, 30011U}) {
            const PointScan scan = make(points, 1);
            for (const bool normals : {false, true}) {
                const Bytes file = file_of(scan, {.normals = normals, .comment = "count"});
                const std::string_view text(reinterpret_cast<const char *>(file.data()), file.size());
                constexpr std::string_view kEnd = "end_header\n";
                const std::size_t body = text.find(kEnd) + kEnd.size();
                EXPECT_NE(text.find("\nelement vertex " + std::to_string(points) + "\n"), std::string_view::npos);
                EXPECT_EQ(file.size() - body, points * (normals ? 27 : 15));
            }
        }
}

TEST(PointScans, ArePutInTextOnRequest) {
    const Bytes file =
        file_of(make_terrain(3, 1), {.encoding = PlyEncoding::ascii, .normals = true, .comment = "text"});
    const std::string text(file.begin(), file.end());
    const std::string body = text.substr(text.find("end_header\n") + 11);
    EXPECT_EQ(std::count(body.begin(), body.end(), '\n'), 3);
    EXPECT_EQ(std::count(body.begin(), body.end(), ' '), 3 * 8);
}

TEST(PointScans, TakeAsMuchMemoryForManyPointsAsForFew) {
    for (const Make make : kShapes) {
        std::size_t few = 0, many = 0;
        file_of(make(20000, 1), {.comment = "memory", .threads = 2}, &few);
        file_of(make(200000, 1), {.comment = "memory", .threads = 2}, &many);
        EXPECT_EQ(few, many);
        EXPECT_EQ(many, 4096U * 15);
    }
}

TEST(PointScans, MakeAnyPartWithoutThePartsBefore) {
    for (const Make make : kShapes) {
        const PointScan scan = make(5000, 1);
        const std::vector<ScanPoint> whole = points_of(scan, 0, 5000);
        for (std::uint64_t first = 0; first < 5000; first += 617) {
            const auto part = points_of(scan, first, std::min<std::size_t>(611, 5000 - first));
            for (std::size_t i = 0; i < part.size(); ++i) {
                ASSERT_EQ(part[i].position, whole[first + i].position);
                ASSERT_EQ(part[i].normal, whole[first + i].normal);
                ASSERT_EQ(part[i].color, whole[first + i].color);
            }
        }
    }
}

TEST(PointScans, ReachTheirLastPointAtTheLargestNumber) {
    for (const Make make : kShapes) {
        const PointScan scan = make(kMaxPoints, 1);
        std::array<float, 3> least{1e9F, 1e9F, 1e9F}, most{-1e9F, -1e9F, -1e9F}; // of few points
        for (const ScanPoint &point : points_of(make(100'000, 1), 0, 100'000))
            for (std::size_t axis = 0; axis < 3; ++axis) {
                least[axis] = std::min(least[axis], point.position[axis]);
                most[axis] = std::max(most[axis], point.position[axis]);
            }
        const std::vector<ScanPoint> last = points_of(scan, kMaxPoints - 1000, 1000);
        for (std::size_t i = 0; i < last.size(); ++i) {
            double squared = 0; // distance from the point before
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const float margin = (most[axis] - least[axis]) / 100;
                ASSERT_GE(last[i].position[axis], least[axis] - margin);
                ASSERT_LE(last[i].position[axis], most[axis] + margin);
                const auto step = static_cast<double>(last[i].position[axis] - last[i > 0 ? i - 1 : 1].position[axis]);
                squared += step * step;
            }
            ASSERT_GT(squared, 0) << "each number is another point";
            ASSERT_LT(std::sqrt(squared), 5 * scan.spacing) << "one scan line";
        }
    }
}

// An error of `write` ends the stream, however many blocks are on their way.
TEST(PointScans, StopWhereWritingFails) {
    int blocks = 0;
    const Status status =
        stream_ply(make_terrain(1'000'000, 1), {.comment = "full", .threads = 2}, [&blocks](ByteView) -> Status {
            if (++blocks == 3)
                return Error{ErrorCode::io, 0, "disk full"};
            return {};
        });
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().message, "disk full");
    EXPECT_EQ(blocks, 3);
}

TEST(PointScans, HaveUnitNormals) {
    for (const Make make : kShapes)
        for (const ScanPoint &point : points_of(make(10000, 1), 0, 10000)) {
            const auto &[x, y, z] = point.normal;
            ASSERT_NEAR(x * x + y * y + z * z, 1.0f, 1e-5f);
        }
}

// Distances from points to their nearest neighbours over the scan's spacing, ascending.
std::vector<double> nearest_distances(const PointScan &scan) {
    const std::vector<ScanPoint> points = points_of(scan, 0, scan.points);
    using Cube = std::array<int, 3>; // edges of 3 spacings
    std::map<Cube, std::vector<Vec3>> cubes;
    const auto place_of = [&](const ScanPoint &p) { return Vec3(p.position[0], p.position[1], p.position[2]); };
    const auto cube_of = [&](const Vec3 &p, int axis) {
        return static_cast<int>(floor_to_int(p[axis] / (3 * scan.spacing)));
    };
    for (const ScanPoint &point : points) {
        const Vec3 p = place_of(point);
        cubes[{cube_of(p, 0), cube_of(p, 1), cube_of(p, 2)}].push_back(p);
    }
    std::vector<double> distances;
    for (const ScanPoint &point : points) {
        const Vec3 p = place_of(point);
        double nearest = 100 * scan.spacing;
        for (int near = 0; near < 27; ++near) {
            const auto found = cubes.find(
                {cube_of(p, 0) + near % 3 - 1, cube_of(p, 1) + near / 3 % 3 - 1, cube_of(p, 2) + near / 9 - 1});
            if (found != cubes.end())
                for (const Vec3 &other : found->second)
                    if (other != p)
                        nearest = std::min(nearest, length(other - p));
        }
        distances.push_back(nearest / scan.spacing);
    }
    std::sort(distances.begin(), distances.end());
    return distances;
}

TEST(PointScans, HaveNeitherClumpsNorLonelyPoints) {
    for (const Make make : kShapes) {
        const std::vector<double> distances = nearest_distances(make(40000, 1));
        EXPECT_GT(distances.front(), 0.12);
        EXPECT_LT(distances.back(), 2.5);
    }
}

std::uint32_t shape_seed(std::uint32_t seed) { return static_cast<std::uint32_t>(hash_bits(seed)); }

float height_at(float x, float z) { return terrain_height(all(x), all(z), shape_seed(1)).value[0]; }

TEST(Terrain, LiesOnItsHeightField) {
    const PointScan scan = make_terrain(10000, 1);
    for (const ScanPoint &point : points_of(scan, 0, 10000)) {
        const auto &[x, y, z] = point.position;
        ASSERT_LE(std::abs(x), kTerrainEdge / 2);
        ASSERT_LE(std::abs(z), kTerrainEdge / 2);
        ASSERT_NEAR(y, height_at(x, z), 0.0501f);
    }
}

TEST(Terrain, HasTheNormalsOfItsHeightField) {
    int rough = 0;
    for (const ScanPoint &point : points_of(make_terrain(10000, 1), 0, 10000)) {
        const auto &[x, y, z] = point.position;
        const auto &[nx, ny, nz] = point.normal;
        ASSERT_GT(ny, 0.0f);
        constexpr float kStep = 0.05f;
        const float along_x = (height_at(x + kStep, z) - height_at(x - kStep, z)) / (2 * kStep);
        const float along_z = (height_at(x, z + kStep) - height_at(x, z - kStep)) / (2 * kStep);
        rough += std::abs(along_x + nx / ny) > 0.03f || std::abs(along_z + nz / ny) > 0.03f;
    }
    EXPECT_LT(rough, 100); // narrow ridges
}

TEST(Terrain, IsEvenlyDense) {
    constexpr int kSquares = 16;
    std::vector<int> counts(kSquares * kSquares);
    for (const ScanPoint &point : points_of(make_terrain(256 * 256, 1), 0, 256 * 256)) {
        const auto square_of = [](float a) {
            const int square = static_cast<int>((a / kTerrainEdge + 0.5f) * kSquares);
            return static_cast<std::size_t>(std::clamp(square, 0, kSquares - 1));
        };
        ++counts[square_of(point.position[0]) * kSquares + square_of(point.position[2])];
    }
    for (const int count : counts)
        EXPECT_NEAR(count, 256, 20);
}

// Distance from the statue's surface along the direction from its line.
float statue_distance(const Lanes3 &point) {
    const CapsulePlace place = capsule_place(point);
    const Float4 away =
        square_root(point.x * point.x + (point.y - place.line_y) * (point.y - place.line_y) + point.z * point.z);
    return away[0] - statue_radius(place, shape_seed(1)).radius.value[0];
}

Lanes3 lanes(double x, double y, double z) {
    return {all(static_cast<float>(x)), all(static_cast<float>(y)), all(static_cast<float>(z))};
}

TEST(Statue, LiesOnItsSurface) {
    for (const ScanPoint &point : points_of(make_statue(10000, 1), 0, 10000)) {
        const auto &[x, y, z] = point.position;
        ASSERT_NEAR(statue_distance(lanes(x, y, z)), 0.0f, 1.1e-4f);
    }
}

TEST(Statue, HasTheOutwardNormalsOfItsSurface) {
    int rough = 0;
    for (const ScanPoint &point : points_of(make_statue(10000, 1), 0, 10000)) {
        const Vec3 at(point.position[0], point.position[1], point.position[2]);
        const Vec3 normal(point.normal[0], point.normal[1], point.normal[2]);
        constexpr double kStep = 2e-4;
        const auto difference = [&at](const Vec3 &step) {
            const Vec3 after = at + step, before = at - step;
            return static_cast<double>(statue_distance(lanes(after.x, after.y, after.z)) -
                                       statue_distance(lanes(before.x, before.y, before.z)));
        };
        const Vec3 gradient(difference({kStep, 0, 0}), difference({0, kStep, 0}), difference({0, 0, kStep}));
        const double cosine = dot(normalized(gradient), normal);
        ASSERT_GT(cosine, 0.0);
        rough += cosine < 0.998;
    }
    EXPECT_LT(rough, 200); // where the surface bends within a step
}

TEST(Statue, ClosesAtBothEndsAndBehind) {
    const auto at = [](float u, float v) {
        const CapsulePlace place = capsule_place(all(u), all(v));
        const Lanes3 p = place.at(statue_radius(place, shape_seed(1)).radius.value);
        return Vec3(p.x[0], p.y[0], p.z[0]);
    };
    for (const float pole : {0.0f, 1.0f})
        for (const float v : {0.1f, 0.4f, 0.7f})
            EXPECT_LT(length(at(pole, v) - at(pole, 0)), 1e-5);
    for (float u = 0; u < 1; u += 0.01f)
        EXPECT_LT(length(at(u, 1) - at(u, 0)), 1e-5);
}

// On a sphere, equal heights have equal areas.
TEST(Sweeps, SpreadPointsEvenlyOverASphere) {
    const Surface sphere = [](double u, const std::vector<float> &v, std::vector<std::array<float, 3>> &out) {
        for (std::size_t i = 0; i < v.size(); ++i) {
            const double level = sin_turns(0.5 * u), turns = static_cast<double>(v[i]);
            out[i] = {static_cast<float>(level * cos_turns(turns)), static_cast<float>(-cos_turns(0.5 * u)),
                      static_cast<float>(level * sin_turns(turns))};
        }
    };
    constexpr std::uint64_t kPoints = 100'000;
    const Sweeps sweeps(sphere, kPoints);
    EXPECT_NEAR(sweeps.area(), 2 * kTwoPi, 0.01);
    std::vector<double> slices(10), quarters(4);
    std::uint64_t next = 0;
    for (std::uint64_t number = 0; number < sweeps.count(); ++number) {
        const Sweeps::Sweep sweep = sweeps.sweep_number(number);
        ASSERT_EQ(sweep.first, next);
        next += sweep.points;
        std::size_t column = 0;
        for (std::uint64_t i = 0; i < sweep.points; ++i) {
            const double part = (static_cast<double>(i) + 0.5) / static_cast<double>(sweep.points);
            quarters[static_cast<std::size_t>(4 * sweeps.around(sweep, part, column))] += 1;
        }
        const double height = -cos_turns(0.5 * (sweep.u + 0.5 * sweep.width));
        slices[static_cast<std::size_t>(5 * (height + 1))] += static_cast<double>(sweep.points);
        if (sweep.points != 0) {
            EXPECT_EQ(sweeps.sweep_of(sweep.first).number, number);
            EXPECT_EQ(sweeps.sweep_of(sweep.first + sweep.points - 1).number, number);
        }
    }
    EXPECT_EQ(next, kPoints);
    for (const double slice : slices)
        EXPECT_NEAR(slice, 0.1 * kPoints, 0.005 * kPoints);
    for (const double quarter : quarters)
        EXPECT_NEAR(quarter, 0.25 * kPoints, 0.002 * kPoints);
}

} // namespace
} // namespace pbm::sample
