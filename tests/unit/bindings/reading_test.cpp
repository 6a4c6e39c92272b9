// Opening, asking, points and validation through the C API.
#include "ball.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <limits>
#include <thread>
#include <tuple>

namespace pbm::test {
namespace {

pbm_info info_of(pbm_model *model) {
    pbm_info info = PBM_NEW(pbm_info);
    pbm_error error;
    EXPECT_EQ(pbm_get_info(model, &info, &error), PBM_OK) << error.message;
    return info;
}

// All points of a level.
struct Points {
    std::vector<double> positions;
    std::vector<float> positions_f32, normals, radii, heights;
    std::vector<std::uint8_t> colours, materials, two_sided, round;
    std::uint64_t count = 0;

    Points(pbm_model *model, int level, int threads = 0) {
        pbm_error error;
        EXPECT_EQ(pbm_count_points(model, level, &count, &error), PBM_OK) << error.message;
        const auto n = static_cast<std::size_t>(count);
        positions.resize(3 * n);
        positions_f32.resize(3 * n);
        normals.resize(3 * n);
        colours.resize(3 * n);
        for (auto *const values : {&radii, &heights})
            values->resize(n);
        for (auto *const values : {&materials, &two_sided, &round})
            values->resize(n);
        float *const fields[] = {heights.data()};
        pbm_points to = PBM_NEW(pbm_points);
        to.capacity = count;
        to.positions = positions.data();
        to.positions_f32 = positions_f32.data();
        to.offset[0] = 10;
        to.normals = normals.data();
        to.colours = colours.data();
        to.radii = radii.data();
        to.materials = materials.data();
        to.two_sided = two_sided.data();
        to.round = round.data();
        to.fields = fields;
        to.field_count = 1;
        to.threads = threads;
        std::uint64_t written = 0;
        EXPECT_EQ(pbm_read_points(model, level, &to, &written, &error), PBM_OK) << error.message;
        EXPECT_EQ(written, count);
    }
    auto all() const {
        return std::tie(positions, positions_f32, normals, radii, heights, colours, materials, two_sided, round);
    }
};

TEST(CApiOpening, SaysWhyAFileIsRefused) {
    pbm_model *model = reinterpret_cast<pbm_model *>(1);
    pbm_error error;
    EXPECT_EQ(pbm_open_file("/nowhere/model.pbvg", &model, &error), PBM_IO);
    EXPECT_EQ(model, nullptr);
    EXPECT_EQ(error.code, PBM_IO);
    EXPECT_EQ(error.offset, PBM_NO_OFFSET);
    EXPECT_TRUE(std::string(error.message).starts_with("/nowhere/model.pbvg: ")) << error.message;
    const std::string text(200, 'x');
    EXPECT_EQ(pbm_open_memory(text.data(), text.size(), &model, &error), PBM_INVALID);
    EXPECT_STREQ(error.name, "header.magic");
    EXPECT_STREQ(error.rule, "2.1");
    EXPECT_EQ(error.offset, PBM_NO_OFFSET);
}

TEST(CApiOpening, APrivateModelOutlivesItsFile) {
    const std::string path = testing::TempDir() + "pbm_private.pbvg";
    pbm_error error;
    pbm_model *model = nullptr, *from_file = nullptr;
    ASSERT_EQ(build_ball({{"depth", "6"}}, path.c_str(), &from_file, &error), PBM_OK) << error.message;
    ASSERT_EQ(pbm_open_private(path.c_str(), &model, &error), PBM_OK) << error.message;
    const Points expected(from_file, 6);
    pbm_close(from_file);
    std::filesystem::resize_file(path, 0); // a mapping of it is gone
    EXPECT_EQ(Points(model, 6).all(), expected.all());
    pbm_close(model);
    EXPECT_EQ(pbm_open_private(path.c_str(), &model, &error), PBM_INVALID);
    EXPECT_TRUE(std::string(error.message).starts_with(path)) << error.message;
    std::filesystem::remove(path);
    for (const char *const name : {"/nowhere/model.pbvg", "/", "/dev/null", "-"})
        EXPECT_EQ(pbm_open_private(name, &model, &error), PBM_IO) << name;
}

TEST(CApiOpening, RefusesNullPointers) {
    pbm_model *model = nullptr;
    pbm_error error;
    EXPECT_EQ(pbm_open_file(nullptr, &model, &error), PBM_USAGE);
    EXPECT_EQ(pbm_open_file("x", nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_open_private(nullptr, &model, &error), PBM_USAGE);
    EXPECT_EQ(pbm_open_private("x", nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_open_memory(nullptr, 10, &model, &error), PBM_USAGE);
    EXPECT_EQ(pbm_open_memory(&error, sizeof error, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_open_ranges(nullptr, nullptr, 10, &model, &error), PBM_USAGE);
    EXPECT_EQ(pbm_open_file(nullptr, nullptr, nullptr), PBM_USAGE); // an error is not asked for
    EXPECT_EQ(pbm_open_memory(&error, 0, &model, nullptr), PBM_INVALID);
}

TEST(CApiOpening, TellsClosedAndForeignHandlesFromOpenOnes) {
    pbm_error error;
    std::uint64_t count = 0;
    pbm_model *closed = nullptr;
    ASSERT_EQ(build_ball({{"depth", "5"}}, nullptr, &closed, &error), PBM_OK) << error.message;
    EXPECT_EQ(pbm_count_points(closed, 0, &count, &error), PBM_OK);
    EXPECT_EQ(pbm_close(closed), PBM_OK);
    EXPECT_EQ(pbm_close(closed), PBM_USAGE);
    EXPECT_EQ(pbm_count_points(closed, 0, &count, &error), PBM_USAGE);
    const BallModel later; // no handle comes again
    EXPECT_EQ(pbm_count_points(closed, 0, &count, &error), PBM_USAGE);
    EXPECT_EQ(pbm_count_points(nullptr, 0, &count, &error), PBM_USAGE);
    EXPECT_EQ(pbm_count_points(reinterpret_cast<pbm_model *>(&error), 0, &count, &error), PBM_USAGE);
    pbm_builder *builder = nullptr;
    ASSERT_EQ(pbm_new_builder(&builder, &error), PBM_OK);
    EXPECT_EQ(pbm_count_points(reinterpret_cast<pbm_model *>(builder), 0, &count, &error), PBM_USAGE);
    EXPECT_EQ(pbm_close(reinterpret_cast<pbm_model *>(builder)), PBM_USAGE);
    EXPECT_EQ(pbm_free_builder(builder), PBM_OK);
    EXPECT_EQ(pbm_free_builder(builder), PBM_USAGE);
    EXPECT_EQ(pbm_close(nullptr), PBM_OK);
    EXPECT_EQ(pbm_free_builder(nullptr), PBM_OK);
}

TEST(CApiOpening, ReadsBytesAtAnyAddress) {
    const std::vector<std::uint8_t> bytes = ball_bytes();
    for (std::size_t shift = 0; shift < 8; ++shift) {
        std::vector<std::uint8_t> moved(bytes.size() + shift);
        std::copy(bytes.begin(), bytes.end(), moved.begin() + static_cast<std::ptrdiff_t>(shift));
        pbm_model *model = nullptr;
        pbm_error error;
        ASSERT_EQ(pbm_open_memory(moved.data() + shift, bytes.size(), &model, &error), PBM_OK) << error.message;
        EXPECT_EQ(info_of(model).depth, 6);
        pbm_close(model);
        pbm_validation validation = PBM_NEW(pbm_validation);
        ASSERT_EQ(pbm_validate_memory(moved.data() + shift, bytes.size(), &validation, &error), PBM_OK);
        EXPECT_EQ(validation.verdict, PBM_OK);
    }
}

TEST(CApiInfo, DescribesTheModel) {
    const BallModel ball(Options{{"depth", "6"}, {"unit", "mm"}, {"up", "y"}, {"name", "a ball"}});
    const pbm_info info = info_of(ball.get());
    EXPECT_EQ(info.depth, 6);
    EXPECT_GT(info.points, 1000U);
    EXPECT_EQ(info.attributes, static_cast<std::uint32_t>(PBM_HAS_COLOURS) | PBM_IS_CLOSED);
    EXPECT_STREQ(info.unit, "mm");
    EXPECT_STREQ(info.up, "+y");
    EXPECT_NE(std::string(info.metadata).find("a ball"), std::string::npos);
    EXPECT_EQ(std::strlen(info.content_id), 32U);
    EXPECT_EQ(info.fields, 1);
    EXPECT_EQ(info.materials, 1);
    EXPECT_EQ(info.lights, 0);
    const double tolerance = info.voxel_size + 1e-9;
    const std::array<double, 3> centre{10, 20, 30};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(info.lowest[axis], centre[axis] - 1, tolerance);
        EXPECT_NEAR(info.highest[axis], centre[axis] + 1, tolerance);
    }
    pbm_field field = PBM_NEW(pbm_field);
    pbm_error error;
    ASSERT_EQ(pbm_get_field(ball.get(), 0, &field, &error), PBM_OK) << error.message;
    EXPECT_STREQ(field.name, "height");
    EXPECT_STREQ(field.unit, "mm");
    EXPECT_STREQ(field.average, "mean");
    EXPECT_NEAR(field.lowest, -1, 1e-9);
    EXPECT_EQ(pbm_get_field(ball.get(), 1, &field, &error), PBM_USAGE);
    EXPECT_EQ(pbm_get_field(ball.get(), -1, &field, &error), PBM_USAGE);
}

TEST(CApiInfo, RefusesStructuresWithoutTheirSize) {
    const BallModel ball;
    pbm_error error;
    pbm_info info{};
    EXPECT_EQ(pbm_get_info(ball.get(), &info, &error), PBM_USAGE);
    EXPECT_NE(std::string(error.message).find("PBM_NEW"), std::string::npos);
    info.struct_size = sizeof info + 8;
    EXPECT_EQ(pbm_get_info(ball.get(), &info, &error), PBM_USAGE);
    EXPECT_EQ(pbm_get_info(ball.get(), nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_get_field(ball.get(), 0, nullptr, &error), PBM_USAGE);
}

TEST(CApiPoints, EveryLevelHasPointsOfTheBall) {
    const BallModel ball;
    const pbm_info info = info_of(ball.get());
    for (int level = 0; level <= info.depth; ++level) {
        const Points points(ball.get(), level);
        const double edge = info.voxel_size * (1 << (info.depth - level));
        ASSERT_GT(points.count, 0U);
        for (std::size_t i = 0; i < points.count; ++i) {
            std::array<double, 3> from{};
            const std::array<double, 3> centre{10, 20, 30};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                from[axis] = points.positions[3 * i + axis] - centre[axis];
                EXPECT_EQ(points.positions_f32[3 * i + axis],
                          static_cast<float>(points.positions[3 * i + axis] - (axis == 0 ? 10 : 0)));
            }
            const float *const n = &points.normals[3 * i];
            EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-6);
            if (level == info.depth) {
                const double distance = std::hypot(from[0], from[1], from[2]);
                EXPECT_NEAR(distance, 1, edge);
                EXPECT_GT((n[0] * from[0] + n[1] * from[1] + n[2] * from[2]) / distance, 0.95);
                EXPECT_EQ(points.colours[3 * i], 200);
                EXPECT_EQ(points.colours[3 * i + 2], 50);
                EXPECT_NEAR(points.heights[i], from[1], edge);
                EXPECT_GT(points.radii[i], edge / 4);
                EXPECT_LT(points.radii[i], 2 * edge);
            }
            EXPECT_EQ(points.materials[i], 0);
            EXPECT_LE(points.two_sided[i], level == info.depth ? 0 : 1);
        }
    }
    EXPECT_EQ(Points(ball.get(), info.depth).count, info.points);
}

TEST(CApiPoints, AreTheSameForAnyNumberOfThreads) {
    const BallModel ball;
    EXPECT_EQ(Points(ball.get(), 6, 1).all(), Points(ball.get(), 6, 3).all());
}

// Streams that no array needs are not decoded.
TEST(CApiPoints, AreTheSameOneArrayAtATime) {
    const BallModel ball;
    const Points all(ball.get(), 6, 1);
    const auto alone = [&](auto pbm_points::*array, const auto &expected) {
        auto values = expected;
        std::fill(values.begin(), values.end(), 1);
        pbm_points to = PBM_NEW(pbm_points);
        to.capacity = all.radii.size();
        to.offset[0] = 10;
        to.*array = values.data();
        pbm_error error;
        EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_OK) << error.message;
        EXPECT_EQ(values, expected);
    };
    alone(&pbm_points::positions, all.positions);
    alone(&pbm_points::positions_f32, all.positions_f32);
    alone(&pbm_points::normals, all.normals);
    alone(&pbm_points::colours, all.colours);
    alone(&pbm_points::radii, all.radii);
    alone(&pbm_points::materials, all.materials);
    alone(&pbm_points::two_sided, all.two_sided);
    alone(&pbm_points::round, all.round);
}

TEST(CApiPoints, SayWhichLieOnNoSurface) {
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_file(PBM_SOURCE_DIR "/format_spec/vectors/valid/shapes.pbvg", &model, &error), PBM_OK);
    pbm_info info = PBM_NEW(pbm_info);
    ASSERT_EQ(pbm_get_info(model, &info, &error), PBM_OK);
    EXPECT_NE(info.attributes & PBM_HAS_ROUND_POINTS, 0U);
    std::vector<std::uint8_t> materials(static_cast<std::size_t>(info.points)), round(materials.size());
    pbm_points to = PBM_NEW(pbm_points);
    to.capacity = info.points;
    to.round = round.data();
    ASSERT_EQ(pbm_read_points(model, info.depth, &to, nullptr, &error), PBM_OK) << error.message;
    to.materials = materials.data();
    ASSERT_EQ(pbm_read_points(model, info.depth, &to, nullptr, &error), PBM_OK) << error.message;
    EXPECT_EQ(round, materials); // the second of two materials is round
    EXPECT_GT(std::count(round.begin(), round.end(), 1), 100);
    pbm_close(model);
}

// A slanted square, red above and blue below.
std::vector<std::uint8_t> thin_wall() {
    std::vector<double> corners;
    std::vector<std::uint8_t> colours;
    for (const double z : {0.001, 0.0})
        for (const double x : {0.0, 1.0})
            for (const double y : {0.0, 1.0}) {
                corners.insert(corners.end(), {x, y, z + 0.3 * x + 0.1 * y});
                const bool is_above = z > 0;
                colours.insert(colours.end(), {static_cast<std::uint8_t>(is_above ? 200 : 40), 40,
                                               static_cast<std::uint8_t>(is_above ? 40 : 200)});
            }
    const std::vector<std::uint32_t> faces{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6};
    pbm_arrays arrays = PBM_NEW(pbm_arrays);
    arrays.vertex_count = corners.size() / 3;
    arrays.positions = corners.data();
    arrays.colours = colours.data();
    arrays.face_count = faces.size() / 3;
    arrays.faces = faces.data();
    const std::string path = temporary("wall.pbvg");
    pbm_error error;
    EXPECT_EQ(build_ball({{"depth", "6"}}, path.c_str(), nullptr, &error, &arrays), PBM_OK) << error.message;
    std::vector<std::uint8_t> bytes = read_file(path);
    std::remove(path.c_str());
    return bytes;
}

// Both sides of the points of a level.
struct Sides {
    std::vector<std::uint64_t> points;
    std::vector<std::array<float, 3>> normals;        // [2 * points]
    std::vector<std::array<std::uint8_t, 3>> colours; // [2 * points]

    Sides(pbm_model *model, int level) {
        pbm_error error;
        std::uint64_t count = 0, written = 0;
        EXPECT_EQ(pbm_count_sides(model, level, &count, &error), PBM_OK) << error.message;
        points.resize(static_cast<std::size_t>(count) + 1); // none of them is without an array
        normals.resize(2 * points.size());
        colours.resize(2 * points.size());
        pbm_sides to = PBM_NEW(pbm_sides);
        to.capacity = count;
        to.points = points.data();
        to.normals = normals.front().data();
        to.colours = colours.front().data();
        EXPECT_EQ(pbm_read_sides(model, level, &to, &written, &error), PBM_OK) << error.message;
        EXPECT_EQ(written, count);
        points.pop_back();
    }
};

TEST(CApiSides, OfAThinWallHaveTheirOwnNormalsAndColours) {
    const std::vector<std::uint8_t> bytes = thin_wall();
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_memory(bytes.data(), bytes.size(), &model, &error), PBM_OK) << error.message;
    EXPECT_NE(info_of(model).attributes & PBM_HAS_SIDES, 0U);
    EXPECT_EQ(info_of(BallModel().get()).attributes & PBM_HAS_SIDES, 0U);
    for (const int level : {4, 6}) {
        const Sides sides(model, level);
        std::uint64_t count = 0;
        ASSERT_EQ(pbm_count_points(model, level, &count, &error), PBM_OK);
        EXPECT_GT(sides.points.size(), count / 2);
        for (std::size_t i = 0; i < sides.points.size(); ++i) {
            EXPECT_LT(sides.points[i], i + 1 < sides.points.size() ? sides.points[i + 1] : count);
            for (std::size_t side = 2 * i; side < 2 * i + 2; ++side)
                EXPECT_EQ(sides.colours[side][sides.normals[side][2] > 0 ? 0 : 2], 200);
            EXPECT_LT(sides.normals[2 * i][2] * sides.normals[2 * i + 1][2], 0);
        }
    }
    EXPECT_TRUE(Sides(model, 0).points.empty());
    pbm_close(model);
}

TEST(CApiSides, RefuseWhatIsNotThere) {
    const std::vector<std::uint8_t> bytes = thin_wall();
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_memory(bytes.data(), bytes.size(), &model, &error), PBM_OK) << error.message;
    std::uint64_t count = 0;
    EXPECT_EQ(pbm_count_sides(model, 7, &count, &error), PBM_USAGE);
    EXPECT_EQ(pbm_count_sides(model, 6, nullptr, &error), PBM_USAGE);
    ASSERT_EQ(pbm_count_sides(model, 6, &count, &error), PBM_OK);
    pbm_sides to = PBM_NEW(pbm_sides);
    to.capacity = count - 1;
    EXPECT_EQ(pbm_read_sides(model, 6, &to, nullptr, &error), PBM_USAGE);
    EXPECT_NE(std::string(error.message).find(std::to_string(count)), std::string::npos) << error.message;
    to.capacity = count;
    EXPECT_EQ(pbm_read_sides(model, 6, &to, nullptr, &error), PBM_OK) << error.message;
    EXPECT_EQ(pbm_read_sides(model, -1, &to, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_read_sides(model, 6, nullptr, nullptr, &error), PBM_USAGE);
    pbm_close(model);
}

TEST(CApiPoints, RefusesArraysThatAreTooShort) {
    const BallModel ball;
    pbm_error error;
    std::uint64_t count = 0;
    ASSERT_EQ(pbm_count_points(ball.get(), 6, &count, &error), PBM_OK);
    std::vector<std::uint8_t> materials(static_cast<std::size_t>(count), 77);
    pbm_points to = PBM_NEW(pbm_points);
    to.capacity = count - 1;
    to.materials = materials.data();
    EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_USAGE);
    EXPECT_NE(std::string(error.message).find(std::to_string(count)), std::string::npos) << error.message;
    EXPECT_EQ(materials[0], 77);
    to.capacity = count;
    EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_OK) << error.message;
    EXPECT_EQ(materials[0], 0);
    EXPECT_EQ(pbm_read_points(ball.get(), 7, &to, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_read_points(ball.get(), -1, &to, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_read_points(ball.get(), 6, nullptr, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_count_points(ball.get(), 6, nullptr, &error), PBM_USAGE);
    to.field_count = 1; // without arrays
    EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_USAGE);
    float *const none[] = {nullptr, nullptr};
    to.fields = none;
    EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_OK) << error.message;
    to.field_count = 2;
    EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_USAGE);
    to.field_count = -1;
    EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_USAGE);
    to.field_count = 0;
    to.threads = -1;
    EXPECT_EQ(pbm_read_points(ball.get(), 6, &to, nullptr, &error), PBM_USAGE);
}

// A file behind a callback.
struct Server {
    std::vector<std::uint8_t> bytes;
    std::uint64_t sent = 0, last = 0; // bytes; end of the last range
    bool fails = false;
    std::uint64_t arrived = UINT64_MAX; // bytes of the file; the others come later
    std::vector<std::pair<std::uint64_t, std::uint64_t>> later{};
    pbm_model *model = nullptr; // asked from within the callback
    pbm_code inner = PBM_OK;

    static int read(void *context, std::uint64_t offset, std::uint64_t size, void *to) {
        auto &server = *static_cast<Server *>(context);
        EXPECT_LE(offset, server.bytes.size());
        EXPECT_LE(size, server.bytes.size() - offset);
        if (server.fails)
            return 1;
        if (offset + size > server.arrived) {
            server.later.emplace_back(offset, size);
            return PBM_LATER;
        }
        std::uint64_t count = 0;
        if (server.model != nullptr)
            server.inner = pbm_count_points(server.model, 0, &count, nullptr);
        std::memcpy(to, server.bytes.data() + offset, static_cast<std::size_t>(size));
        server.sent += size;
        server.last = std::max(server.last, offset + size);
        return 0;
    }
};

TEST(CApiRanges, GiveTheSameAsTheWholeFile) {
    for (const char *const store : {"packed", "mapped"}) {
        const Options options{{"depth", "7"},          {"store", store},          {"ground", "wood"},
                              {"panorama", "default"}, {"panorama-width", "256"}, {"ground-resolution", "64"}};
        Server server{.bytes = ball_bytes(options)};
        pbm_model *whole = nullptr, *ranged = nullptr;
        pbm_error error;
        ASSERT_EQ(pbm_open_memory(server.bytes.data(), server.bytes.size(), &whole, &error), PBM_OK) << error.message;
        ASSERT_EQ(pbm_open_ranges(Server::read, &server, server.bytes.size(), &ranged, &error), PBM_OK)
            << error.message;
        EXPECT_LT(server.sent, 8192U); // header and small sections
        const pbm_info a = info_of(whole), b = info_of(ranged);
        EXPECT_STREQ(a.content_id, b.content_id);
        EXPECT_TRUE(std::equal(std::begin(a.lowest), std::end(a.lowest), std::begin(b.lowest)));
        Picture first(60, 40), second(60, 40);
        const pbm_camera camera = camera_of(ranged, 60, 40);
        ASSERT_EQ(pbm_render(whole, &camera, nullptr, &first.api, &error), PBM_OK) << error.message;
        ASSERT_EQ(pbm_render(ranged, &camera, nullptr, &second.api, &error), PBM_OK) << error.message;
        EXPECT_EQ(first.pixels, second.pixels);
        EXPECT_EQ(first.depths, second.depths);
        EXPECT_LT(server.sent, server.bytes.size()); // a small picture of a finer model
        for (const int level : {0, 3, 7})
            EXPECT_EQ(Points(whole, level).all(), Points(ranged, level).all());
        pbm_close(whole);
        pbm_close(ranged);
    }
}

TEST(CApiRanges, ReportsWhatTheCallbackCannotRead) {
    Server server{.bytes = ball_bytes(), .fails = true};
    pbm_model *model = nullptr;
    pbm_error error;
    EXPECT_EQ(pbm_open_ranges(Server::read, &server, server.bytes.size(), &model, &error), PBM_IO);
    server.fails = false;
    ASSERT_EQ(pbm_open_ranges(Server::read, &server, server.bytes.size(), &model, &error), PBM_OK);
    server.fails = true;
    pbm_info info = PBM_NEW(pbm_info);
    EXPECT_EQ(pbm_get_info(model, &info, &error), PBM_IO);
    Picture picture(8, 8);
    pbm_camera camera = PBM_NEW(pbm_camera);
    EXPECT_EQ(pbm_default_camera(model, 8, 8, &camera, &error), PBM_IO);
    server.fails = false; // and goes on when the server is back
    server.model = model;
    EXPECT_EQ(pbm_get_info(model, &info, &error), PBM_OK) << error.message;
    EXPECT_EQ(server.inner, PBM_USAGE); // a callback has called with its own handle
    pbm_close(model);
    EXPECT_EQ(pbm_open_ranges(Server::read, &server, 10, &model, &error), PBM_INVALID);
}

// Bytes arrive in order, piece by piece: pictures become finer, and the last one is that of the whole file.
void expect_pictures_become_finer(const char *colour_by) {
    pbm_render_options look = PBM_NEW(pbm_render_options);
    look.colour_by = colour_by;
    for (const char *const store : {"packed", "mapped"}) {
        const Options options{{"depth", "7"},          {"store", store},          {"ground", "wood"},
                              {"panorama", "default"}, {"panorama-width", "256"}, {"ground-resolution", "64"}};
        Server server{.bytes = ball_bytes(options), .arrived = 0};
        pbm_model *whole = nullptr, *ranged = nullptr;
        pbm_error error;
        ASSERT_EQ(pbm_open_memory(server.bytes.data(), server.bytes.size(), &whole, &error), PBM_OK) << error.message;
        const pbm_camera camera = camera_of(whole, 300, 200);
        Picture exact(300, 200), drawn(300, 200);
        ASSERT_EQ(pbm_render(whole, &camera, &look, &exact.api, &error), PBM_OK) << error.message;
        EXPECT_EQ(pbm_open_ranges(Server::read, &server, server.bytes.size(), &ranged, &error), PBM_PENDING);
        EXPECT_EQ(error.code, PBM_PENDING);
        EXPECT_EQ(error.offset, 0U);
        EXPECT_EQ(ranged, nullptr);

        int pending = 0, pictures = 0;
        bool is_exact = false;
        for (; !is_exact; server.arrived += 4096) {
            ASSERT_LT(server.arrived, server.bytes.size() + 4096);
            if (ranged == nullptr) {
                pbm_open_ranges(Server::read, &server, server.bytes.size(), &ranged, &error);
                continue;
            }
            pbm_info info = PBM_NEW(pbm_info);
            const pbm_code informed = pbm_get_info(ranged, &info, &error);
            pbm_camera chosen = PBM_NEW(pbm_camera);
            EXPECT_EQ(pbm_default_camera(ranged, 300, 200, &chosen, &error), informed);
            if (informed == PBM_OK)
                EXPECT_EQ(chosen.position[2], camera.position[2]);
            else
                EXPECT_EQ(informed, PBM_PENDING) << error.message;
            pending += informed == PBM_PENDING ? 1 : 0;
            server.later.clear();
            ASSERT_EQ(pbm_render(ranged, &camera, &look, &drawn.api, &error), PBM_OK) << error.message;
            is_exact = server.later.empty();
            ++pictures;
            EXPECT_TRUE(!is_exact || drawn.pixels == exact.pixels);
        }
        EXPECT_GT(pending, 0);
        EXPECT_GT(pictures, 3);
        EXPECT_EQ(drawn.pixels, exact.pixels);
        EXPECT_EQ(drawn.depths, exact.depths);
        pbm_close(whole);
        pbm_close(ranged);
    }
}

TEST(CApiRanges, DrawWhatHasArrived) { expect_pictures_become_finer(nullptr); }

TEST(CApiRanges, DrawTheColoursOfAFieldOnceTheyHaveArrived) { expect_pictures_become_finer("height"); }

TEST(CApiRanges, SidesNeedTheirOwnSectionsAndNoPoints) {
    Server server{.bytes = thin_wall()};
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_ranges(Server::read, &server, server.bytes.size(), &model, &error), PBM_OK) << error.message;
    server.arrived = server.last;
    std::uint64_t count = 0;
    EXPECT_EQ(pbm_count_sides(model, 6, &count, &error), PBM_PENDING);
    server.arrived = UINT64_MAX;
    const Sides sides(model, 6);
    pbm_model *whole = nullptr;
    ASSERT_EQ(pbm_open_memory(server.bytes.data(), server.bytes.size(), &whole, &error), PBM_OK) << error.message;
    const Sides expected(whole, 6);
    EXPECT_EQ(sides.points, expected.points);
    EXPECT_EQ(sides.normals, expected.normals);
    EXPECT_EQ(sides.colours, expected.colours);
    pbm_close(whole);
    pbm_close(model);
}

// A call that lacks bytes asks for all ranges that it knows it needs, so that they can be fetched at once.
TEST(CApiRanges, AsksForAllRangesThatItKnowsOf) {
    Server server{.bytes = ball_bytes({{"depth", "7"}})};
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_ranges(Server::read, &server, server.bytes.size(), &model, &error), PBM_OK) << error.message;
    const std::uint64_t opened = server.last;
    for (const int level : {1, 7}) {
        server.later.clear();
        server.arrived = opened;
        std::uint64_t count = 0;
        EXPECT_EQ(pbm_count_points(model, level, &count, &error), PBM_PENDING);
        EXPECT_EQ(server.later.size(), level == 1 ? 1U : 6U); // directories
        server.later.clear();
        server.arrived = UINT64_MAX;
        ASSERT_EQ(pbm_count_points(model, level, &count, &error), PBM_OK) << error.message;
        std::vector<double> positions(static_cast<std::size_t>(3 * count));
        std::vector<float> heights(static_cast<std::size_t>(count));
        float *const fields[] = {heights.data()};
        pbm_points to = PBM_NEW(pbm_points);
        to.capacity = count;
        to.positions = positions.data();
        for (const int field_count : {0, 1}) {
            to.fields = fields;
            to.field_count = field_count;
            server.arrived = opened;
            // Fields need the whole file, which is kept.
            const bool is_there = level == 7 && field_count == 1;
            EXPECT_EQ(pbm_read_points(model, level, &to, nullptr, &error), is_there ? PBM_OK : PBM_PENDING);
            EXPECT_EQ(server.later.empty(), is_there);
            server.later.clear();
            server.arrived = UINT64_MAX;
            EXPECT_EQ(pbm_read_points(model, level, &to, nullptr, &error), PBM_OK) << error.message;
        }
        const Points expected(model, level);
        EXPECT_TRUE(std::equal(positions.begin(), positions.end(), expected.positions.begin()));
    }
    pbm_close(model);
}

TEST(CApiValidation, GivesVerdictsAndFindings) {
    std::vector<std::uint8_t> bytes = ball_bytes();
    pbm_error error;
    pbm_validation validation = PBM_NEW(pbm_validation);
    struct Seen {
        std::vector<std::string> names{};
        int stop_after = 1000;
    } seen;
    validation.context = &seen;
    validation.report = [](void *context, const pbm_finding *finding) {
        auto &to = *static_cast<Seen *>(context);
        to.names.emplace_back(finding->name);
        EXPECT_NE(std::string(finding->message), "");
        EXPECT_NE(std::string(finding->remedy), "");
        return static_cast<int>(to.names.size()) >= to.stop_after ? 1 : 0;
    };
    for (const int level : {PBM_VALIDATE, PBM_VALIDATE_QUICK, PBM_VALIDATE_DEEP}) {
        validation.level = level;
        ASSERT_EQ(pbm_validate_memory(bytes.data(), bytes.size(), &validation, &error), PBM_OK) << error.message;
        EXPECT_EQ(validation.verdict, PBM_OK);
        EXPECT_EQ(validation.errors, 0U);
    }
    bytes[bytes.size() / 2] ^= 1U;
    validation.level = PBM_VALIDATE;
    seen.names.clear();
    ASSERT_EQ(pbm_validate_memory(bytes.data(), bytes.size(), &validation, &error), PBM_OK) << error.message;
    EXPECT_EQ(validation.verdict, PBM_INVALID);
    EXPECT_GE(validation.errors, 1U);
    EXPECT_EQ(seen.names.size(), validation.errors);
    seen = {.names = {}, .stop_after = 1};
    EXPECT_EQ(pbm_validate_memory(bytes.data(), bytes.size(), &validation, &error), PBM_CANCELLED);
    EXPECT_EQ(error.code, PBM_CANCELLED);
    validation.report = nullptr;
    EXPECT_EQ(pbm_validate_memory(bytes.data(), bytes.size(), &validation, &error), PBM_OK);
    EXPECT_EQ(pbm_validate_memory(bytes.data(), 0, &validation, &error), PBM_OK);
    EXPECT_EQ(validation.verdict, PBM_INVALID);
    EXPECT_EQ(pbm_validate_file("/nowhere", &validation, &error), PBM_IO);
    EXPECT_EQ(pbm_validate_file(nullptr, &validation, &error), PBM_USAGE);
    EXPECT_EQ(pbm_validate_memory(nullptr, 1, &validation, &error), PBM_USAGE);
    EXPECT_EQ(pbm_validate_memory(bytes.data(), bytes.size(), nullptr, &error), PBM_USAGE);
    validation.level = 9;
    EXPECT_EQ(pbm_validate_memory(bytes.data(), bytes.size(), &validation, &error), PBM_USAGE);
}

TEST(CApiPoints, SaysWhereADamagedChunkLies) {
    std::vector<std::uint8_t> bytes = ball_bytes();
    bytes[bytes.size() - bytes.size() / 4] ^= 1U;
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_memory(bytes.data(), bytes.size(), &model, &error), PBM_OK) << error.message;
    std::uint64_t count = 0;
    ASSERT_EQ(pbm_count_points(model, 6, &count, &error), PBM_OK) << error.message;
    std::vector<double> positions(static_cast<std::size_t>(3 * count));
    std::vector<float> heights(static_cast<std::size_t>(count));
    float *const fields[] = {heights.data()};
    pbm_points to = PBM_NEW(pbm_points);
    to.capacity = count;
    to.positions = positions.data();
    to.fields = fields;
    to.field_count = 1;
    EXPECT_EQ(pbm_read_points(model, 6, &to, nullptr, &error), PBM_INVALID);
    EXPECT_NE(error.offset, PBM_NO_OFFSET);
    EXPECT_NE(std::string(error.name), "");
    pbm_close(model);
}

TEST(CApiThreads, CallsWithOneHandleWaitForEachOther) {
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(build_ball({{"depth", "6"}}, nullptr, &model, &error), PBM_OK) << error.message;
    const pbm_camera camera = camera_of(model, 32, 32);
    std::atomic<int> done = 0, refused = 0;
    std::vector<std::thread> threads;
    threads.reserve(4);
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            for (int i = 0; i < 5; ++i) {
                Picture picture(32, 32);
                std::uint64_t count = 0;
                const pbm_code drawn = pbm_render(model, &camera, nullptr, &picture.api, nullptr);
                const pbm_code counted = pbm_count_points(model, i, &count, nullptr);
                for (const pbm_code code : {drawn, counted})
                    ++(code == PBM_OK ? done : refused);
                if (i == 4)
                    pbm_close(model); // the others are refused from now on
            }
        });
    for (std::thread &thread : threads)
        thread.join();
    EXPECT_EQ(done + refused, 40);
    EXPECT_GE(done, 10);
}

} // namespace
} // namespace pbm::test
