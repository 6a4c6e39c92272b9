// Building through the C API.
#include "ball.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <set>

namespace pbm::test {
namespace {

std::string message_of(const Options &options, pbm_code code, const pbm_arrays *arrays = nullptr) {
    pbm_model *model = nullptr;
    pbm_error error{};
    EXPECT_EQ(build_ball(options, nullptr, &model, &error, arrays), code) << error.message;
    EXPECT_EQ(model, nullptr);
    pbm_close(model);
    return error.message;
}

std::string content_id(pbm_model *model) {
    pbm_info info = PBM_NEW(pbm_info);
    EXPECT_EQ(pbm_get_info(model, &info, nullptr), PBM_OK);
    return info.content_id;
}

// The ball as a PLY file with doubles.
std::string ply_of(const Ball &ball) {
    std::string path = temporary("ball.ply");
    std::FILE *const file = std::fopen(path.c_str(), "w");
    std::fprintf(file,
                 "ply\nformat ascii 1.0\nelement vertex %zu\nproperty double x\nproperty double y\n"
                 "property double z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                 "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                 "element face %zu\nproperty list uchar int vertex_indices\nend_header\n",
                 ball.positions.size(), ball.faces.size());
    for (std::size_t i = 0; i < ball.positions.size(); ++i) {
        const auto &[x, y, z] = ball.positions[i];
        const auto &[nx, ny, nz] = ball.normals[i];
        const auto &[red, green, blue] = ball.colours[i];
        std::fprintf(file, "%.17g %.17g %.17g %.9g %.9g %.9g %d %d %d\n", x, y, z, static_cast<double>(nx),
                     static_cast<double>(ny), static_cast<double>(nz), red, green, blue);
    }
    for (const auto &[a, b, c] : ball.faces)
        std::fprintf(file, "3 %u %u %u\n", a, b, c);
    std::fclose(file);
    return path;
}

TEST(CApiBuilding, ArraysAndAFileGiveTheSameModel) {
    const Ball ball;
    pbm_builder *builder = nullptr;
    pbm_model *of_file = nullptr, *of_arrays = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_new_builder(&builder, &error), PBM_OK);
    ASSERT_EQ(pbm_set_option(builder, "depth", "6", &error), PBM_OK);
    ASSERT_EQ(pbm_add_file(builder, ply_of(ball).c_str(), &error), PBM_OK) << error.message;
    ASSERT_EQ(pbm_build(builder, nullptr, &of_file, &error), PBM_OK) << error.message;
    std::remove(temporary("ball.ply").c_str());
    pbm_arrays arrays = ball.arrays();
    arrays.field_count = 0;
    ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK) << error.message;
    ASSERT_EQ(pbm_build(builder, nullptr, &of_arrays, &error), PBM_OK) << error.message;
    EXPECT_EQ(content_id(of_file), content_id(of_arrays));
    pbm_close(of_file);
    pbm_close(of_arrays);
    const char *json = nullptr;
    ASSERT_EQ(pbm_get_report(builder, &json, &error), PBM_OK);
    EXPECT_NE(std::string(json).find("\"normals\""), std::string::npos) << json;
    pbm_free_builder(builder);
}

TEST(CApiBuilding, ACloudOfFloatsGetsNormals) {
    const Ball ball;
    std::vector<float> positions;
    for (const auto &at : ball.positions)
        positions.insert(positions.end(),
                         {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])});
    std::vector<float> radii(ball.positions.size(), 0.1F);
    std::vector<std::uint8_t> materials(ball.positions.size(), 1);
    pbm_arrays arrays = PBM_NEW(pbm_arrays);
    arrays.vertex_count = ball.positions.size();
    arrays.positions_f32 = positions.data();
    arrays.radii = radii.data();
    arrays.materials = materials.data();
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(
        build_ball({{"depth", "5"}, {"material", "gold"}, {"material", "marble"}}, nullptr, &model, &error, &arrays),
        PBM_OK)
        << error.message;
    pbm_info info = PBM_NEW(pbm_info);
    ASSERT_EQ(pbm_get_info(model, &info, &error), PBM_OK);
    EXPECT_EQ(info.materials, 2);
    EXPECT_EQ(info.attributes, static_cast<std::uint32_t>(PBM_HAS_MATERIALS));
    pbm_close(model);
}

TEST(CApiBuilding, RefusesArraysThatContradictThemselves) {
    const Ball ball;
    const auto refused = [&](auto &&spoil) {
        pbm_arrays arrays = ball.arrays();
        spoil(arrays);
        return message_of({{"depth", "5"}}, PBM_USAGE, &arrays);
    };
    const std::vector<float> floats(3 * ball.positions.size());
    const std::vector<std::uint32_t> outside{0, 1, static_cast<std::uint32_t>(ball.positions.size())}, twice{0, 0, 1};
    const std::vector<std::uint8_t> materials(ball.positions.size(), 8);
    const char *const no_names[] = {nullptr}, *const bad_names[] = {"a,b"}, *const twins[] = {"a", "a"};
    const double *const no_values[] = {nullptr}, *const values[] = {ball.heights.data(), ball.heights.data()};
    refused([](pbm_arrays &a) { a.positions = nullptr; });
    refused([&](pbm_arrays &a) { a.positions_f32 = floats.data(); });
    refused([](pbm_arrays &a) { a.vertex_count = 0; });
    refused([](pbm_arrays &a) { a.vertex_count = std::uint64_t{1} << 31; });
    refused([](pbm_arrays &a) { a.faces = nullptr; });
    EXPECT_NE(refused([&](pbm_arrays &a) { a.faces = outside.data(), a.face_count = 1; }).find("face 0"),
              std::string::npos);
    refused([&](pbm_arrays &a) { a.faces = twice.data(), a.face_count = 1; });
    refused([&](pbm_arrays &a) { a.materials = materials.data(); });
    refused([](pbm_arrays &a) { a.field_count = -1; });
    refused([](pbm_arrays &a) { a.field_count = 9; });
    refused([](pbm_arrays &a) { a.field_names = nullptr; });
    refused([](pbm_arrays &a) { a.field_values = nullptr; });
    refused([&](pbm_arrays &a) { a.field_names = no_names; });
    refused([&](pbm_arrays &a) { a.field_names = bad_names; });
    refused([&](pbm_arrays &a) { a.field_values = no_values; });
    refused([&](pbm_arrays &a) {
        a.field_count = 2, a.field_names = twins, a.field_units = nullptr, a.field_values = values;
    });
    refused([](pbm_arrays &a) { a.struct_size = 8; });
    std::vector<std::array<double, 3>> infinite(ball.positions.size());
    for (auto &at : infinite)
        at.fill(std::numeric_limits<double>::infinity());
    pbm_arrays arrays = ball.arrays();
    arrays.positions = infinite.front().data();
    message_of({{"depth", "5"}}, PBM_INVALID, &arrays);
}

TEST(CApiBuilding, OptionsAreThoseOfTheProgram) {
    EXPECT_NE(message_of({{"dept", "6"}}, PBM_USAGE).find("did you mean 'depth'?"), std::string::npos);
    EXPECT_NE(message_of({{"depth", "99"}}, PBM_USAGE).find("99"), std::string::npos);
    message_of({{"depth", nullptr}}, PBM_USAGE);
    message_of({{"strict", "perhaps"}}, PBM_USAGE);
    message_of({{"depth", "6"}, {"voxel-size", "0.1"}}, PBM_USAGE);
    message_of({{"shadow-bits", "4"}}, PBM_USAGE); // needs shadows
    message_of({{"field", "weight"}}, PBM_USAGE);  // the arrays have none
    message_of({{"grid-like", "/nowhere.pbvg"}}, PBM_IO);
    message_of({{"panorama", "/nowhere.png"}}, PBM_IO);
    for (const char *const of_programs :
         {"output", "json", "quiet", "batch", "cache", "max-memory", "help", "version", "log", "INPUT", ""})
        message_of({{of_programs, "x"}}, PBM_USAGE);
    message_of({{"columns", "x,y,z"}}, PBM_USAGE);
    message_of({{"input-format", "ply"}}, PBM_USAGE);
    message_of({{"pose", "/nowhere"}}, PBM_USAGE);
    const BallModel good(Options{{"depth", "5"}, {"strict", "false"}, {"flip-faces", "true"}, {"threads", "1"}});
}

TEST(CApiBuilding, TakesOptionsOfARecipe) {
    const std::string path = temporary("recipe.toml");
    const auto write = [&](const std::string &text) { std::ofstream(path) << text; };
    write("depth = 5\n[[light]]\nkind = \"directional\"\ndirection = [0, -1, 0]\n");
    const BallModel model(Options{{"recipe", path.c_str()}});
    pbm_info info = PBM_NEW(pbm_info);
    ASSERT_EQ(pbm_get_info(model.get(), &info, nullptr), PBM_OK);
    EXPECT_EQ(info.depth, 5);
    EXPECT_EQ(info.lights, 1);
    write("depth = 5\noutput = \"elsewhere.pbvg\"\n");
    EXPECT_NE(message_of({{"recipe", path.c_str()}}, PBM_USAGE).find("line 2"), std::string::npos);
    write("depth = \n");
    message_of({{"recipe", path.c_str()}}, PBM_USAGE);
    message_of({{"recipe", "/nowhere.toml"}}, PBM_IO);
    std::remove(path.c_str());
}

TEST(CApiBuilding, NeedsAScanAndSomewhereToPutTheModel) {
    const Ball ball;
    const pbm_arrays arrays = ball.arrays();
    pbm_builder *builder = nullptr;
    pbm_model *model = nullptr;
    pbm_error error;
    const char *json = nullptr;
    ASSERT_EQ(pbm_new_builder(&builder, &error), PBM_OK);
    EXPECT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_USAGE); // no scan
    EXPECT_EQ(pbm_get_report(builder, &json, &error), PBM_USAGE);
    EXPECT_EQ(pbm_get_report(builder, nullptr, &error), PBM_USAGE);
    ASSERT_EQ(pbm_set_option(builder, "depth", "5", &error), PBM_OK);
    ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
    EXPECT_EQ(pbm_build(builder, nullptr, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_build(builder, "-", nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_build(builder, "", nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_build(builder, "/nowhere/model.pbvg", nullptr, &error), PBM_IO);
    EXPECT_EQ(pbm_add_file(builder, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_add_file(builder, "", &error), PBM_USAGE);
    EXPECT_EQ(pbm_add_file(builder, "-", &error), PBM_USAGE);
    EXPECT_EQ(pbm_add_arrays(builder, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_set_option(builder, nullptr, "5", &error), PBM_USAGE);
    EXPECT_EQ(pbm_new_builder(nullptr, &error), PBM_USAGE);
    ASSERT_EQ(pbm_add_file(builder, "/nowhere.ply", &error), PBM_OK);
    EXPECT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_IO) << error.message;
    ASSERT_EQ(pbm_add_file(builder, "/nowhere.ply", &error), PBM_OK);
    ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
    EXPECT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_USAGE); // of two kinds
    pbm_free_builder(builder);
    EXPECT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_USAGE);
    EXPECT_EQ(pbm_add_file(builder, "x", &error), PBM_USAGE);
}

struct Watcher {
    std::set<std::string> steps{};
    int calls = 0, cancel_at = 0;
    bool stays_until_replaced = false; // cancels by the last call that can
    pbm_builder *builder = nullptr;
    pbm_code inner = PBM_OK;

    static int watch(void *context, const char *step, double done) {
        auto &watcher = *static_cast<Watcher *>(context);
        EXPECT_GE(done, 0);
        EXPECT_LE(done, 1);
        watcher.steps.insert(step);
        if (watcher.builder != nullptr)
            watcher.inner = pbm_add_file(watcher.builder, "x", nullptr);
        if (watcher.stays_until_replaced)
            return step == std::string("write") && done == std::nextafter(1.0, 0.0) ? 1 : 0;
        return ++watcher.calls == watcher.cancel_at ? 1 : 0;
    }
};

TEST(CApiBuilding, ReportsProgressAndIsCancelledAtAnyStep) {
    const Ball ball;
    const pbm_arrays arrays = ball.arrays();
    const std::string path = temporary("cancelled.pbvg");
    pbm_builder *builder = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_new_builder(&builder, &error), PBM_OK);
    ASSERT_EQ(pbm_set_option(builder, "depth", "5", &error), PBM_OK);
    Watcher watcher{.builder = builder};
    ASSERT_EQ(pbm_set_progress(builder, Watcher::watch, &watcher, &error), PBM_OK);
    ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
    ASSERT_EQ(pbm_build(builder, path.c_str(), nullptr, &error), PBM_OK) << error.message;
    EXPECT_TRUE(watcher.steps.count("voxelize") == 1 && watcher.steps.count("write") == 1);
    EXPECT_EQ(watcher.inner, PBM_USAGE); // a callback has called with its own handle
    const std::vector<std::uint8_t> old = read_file(path);
    ASSERT_FALSE(old.empty());
    const int all = watcher.calls;
    int cancelled = 0;
    for (int at = 1; at <= all; ++at) {
        Watcher stopper{.cancel_at = at};
        ASSERT_EQ(pbm_set_progress(builder, Watcher::watch, &stopper, &error), PBM_OK);
        ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
        const pbm_code code = pbm_build(builder, path.c_str(), nullptr, &error);
        cancelled += code == PBM_CANCELLED ? 1 : 0;
        EXPECT_TRUE(code == PBM_CANCELLED || (code == PBM_OK && at > all - 3)) << at << " of " << all;
        EXPECT_EQ(stopper.calls, code == PBM_OK ? stopper.calls : at); // no call after the one that cancelled
        EXPECT_EQ(read_file(path), old);
    }
    EXPECT_GE(cancelled, all - 3);
    Watcher last{.stays_until_replaced = true};
    ASSERT_EQ(pbm_set_option(builder, "name", "Another", &error), PBM_OK);
    ASSERT_EQ(pbm_set_progress(builder, Watcher::watch, &last, &error), PBM_OK);
    ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
    EXPECT_EQ(pbm_build(builder, path.c_str(), nullptr, &error), PBM_CANCELLED);
    EXPECT_EQ(read_file(path), old);
    ASSERT_EQ(pbm_set_progress(builder, nullptr, nullptr, &error), PBM_OK);
    pbm_free_builder(builder);
    std::remove(path.c_str());
}

// Asks for the end of the build from within, as another thread would.
struct Canceller {
    pbm_builder *builder;
    std::string at;
    int calls_after = 0;

    static int watch(void *context, const char *step, double done) {
        auto &canceller = *static_cast<Canceller *>(context);
        if (canceller.at.empty())
            ++canceller.calls_after;
        if (step == canceller.at && done < 1) {
            EXPECT_EQ(pbm_cancel_build(canceller.builder), PBM_OK);
            canceller.at.clear();
        }
        return 0;
    }
};

TEST(CApiBuilding, AnotherThreadCancelsABuild) {
    const Ball ball;
    const pbm_arrays arrays = ball.arrays();
    pbm_builder *builder = nullptr;
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_new_builder(&builder, &error), PBM_OK);
    ASSERT_EQ(pbm_set_option(builder, "depth", "6", &error), PBM_OK);
    for (const char *const step : {"choose grid", "voxelize", "detail levels"}) {
        Canceller canceller{builder, step};
        ASSERT_EQ(pbm_set_progress(builder, Canceller::watch, &canceller, &error), PBM_OK);
        ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
        EXPECT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_CANCELLED) << step;
        EXPECT_EQ(canceller.calls_after, 0) << step;
    }
    ASSERT_EQ(pbm_set_progress(builder, nullptr, nullptr, &error), PBM_OK);
    ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
    EXPECT_EQ(pbm_cancel_build(builder), PBM_OK); // the next one
    EXPECT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_CANCELLED);
    ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
    EXPECT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_OK) << error.message;
    pbm_close(model);
    pbm_free_builder(builder);
    EXPECT_EQ(pbm_cancel_build(builder), PBM_USAGE);
    EXPECT_EQ(pbm_cancel_build(nullptr), PBM_USAGE);
}

TEST(CApiBuilding, SeveralScansBecomeOneModel) {
    const Ball ball;
    const pbm_arrays arrays = ball.arrays();
    pbm_builder *builder = nullptr;
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_new_builder(&builder, &error), PBM_OK);
    ASSERT_EQ(pbm_set_option(builder, "depth", "5", &error), PBM_OK);
    for (int i = 0; i < 2; ++i)
        ASSERT_EQ(pbm_add_arrays(builder, &arrays, &error), PBM_OK);
    ASSERT_EQ(pbm_build(builder, nullptr, &model, &error), PBM_OK) << error.message;
    const BallModel one(Options{{"depth", "5"}});
    pbm_info a = PBM_NEW(pbm_info), b = PBM_NEW(pbm_info);
    ASSERT_EQ(pbm_get_info(model, &a, &error), PBM_OK);
    ASSERT_EQ(pbm_get_info(one.get(), &b, &error), PBM_OK);
    EXPECT_EQ(a.points, b.points);
    pbm_close(model);
    pbm_free_builder(builder);
}

} // namespace
} // namespace pbm::test
