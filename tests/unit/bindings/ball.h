// A ball of triangles with colours, normals and a field, and models of it, through the C API alone.
#pragma once

#include <pbm/pbm.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

namespace pbm::test {

struct Ball {
    static constexpr int kRings = 24, kSectors = 48;
    std::vector<std::array<double, 3>> positions;
    std::vector<std::array<float, 3>> normals;
    std::vector<std::array<std::uint8_t, 3>> colours;
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<double> heights;
    std::vector<const char *> field_names{"height"}, field_units{"mm"};
    std::vector<const double *> field_values;

    Ball() {
        constexpr double kPi = 3.14159265358979;
        for (int ring = 0; ring <= kRings; ++ring)
            for (int sector = 0; sector < kSectors; ++sector) {
                const double polar = kPi * ring / kRings, around = 2 * kPi * sector / kSectors;
                const std::array<double, 3> at{std::sin(polar) * std::cos(around), std::cos(polar),
                                               std::sin(polar) * std::sin(around)};
                positions.push_back({10 + at[0], 20 + at[1], 30 + at[2]});
                normals.push_back({static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])});
                colours.push_back({200, static_cast<std::uint8_t>(100 + ring), 50});
                heights.push_back(at[1]);
            }
        const auto vertex = [](int ring, int sector) {
            return static_cast<std::uint32_t>(ring * kSectors + sector % kSectors);
        };
        for (int ring = 0; ring < kRings; ++ring)
            for (int sector = 0; sector < kSectors; ++sector) {
                const auto a = vertex(ring, sector), b = vertex(ring, sector + 1), c = vertex(ring + 1, sector),
                           d = vertex(ring + 1, sector + 1);
                faces.push_back({a, b, c});
                faces.push_back({b, d, c});
            }
        field_values.push_back(heights.data());
    }
    Ball(const Ball &) = delete;
    Ball &operator=(const Ball &) = delete;

    pbm_arrays arrays() const {
        pbm_arrays to = PBM_NEW(pbm_arrays);
        to.vertex_count = positions.size();
        to.positions = positions.front().data();
        to.normals = normals.front().data();
        to.colours = colours.front().data();
        to.face_count = faces.size();
        to.faces = faces.front().data();
        to.field_count = 1;
        to.field_names = field_names.data();
        to.field_units = field_units.data();
        to.field_values = field_values.data();
        return to;
    }
};

using Options = std::vector<std::pair<const char *, const char *>>;

// Builds the ball with these options, and an error in `error`.
inline pbm_code build_ball(const Options &options, const char *output, pbm_model **model, pbm_error *error,
                           const pbm_arrays *arrays = nullptr) {
    const Ball ball;
    const pbm_arrays own = ball.arrays();
    pbm_builder *builder = nullptr;
    pbm_code code = pbm_new_builder(&builder, error);
    for (const auto &[key, value] : options)
        if (code == PBM_OK)
            code = pbm_set_option(builder, key, value, error);
    if (code == PBM_OK)
        code = pbm_add_arrays(builder, arrays == nullptr ? &own : arrays, error);
    if (code == PBM_OK)
        code = pbm_build(builder, output, model, error);
    pbm_free_builder(builder);
    return code;
}

// A model of the ball in memory.
class BallModel {
  public:
    explicit BallModel(const Options &options = {{"depth", "6"}}) {
        EXPECT_EQ(build_ball(options, nullptr, &model_, &error_), PBM_OK) << error_.message;
    }
    ~BallModel() { pbm_close(model_); }
    BallModel(const BallModel &) = delete;
    BallModel &operator=(const BallModel &) = delete;

    pbm_model *get() const { return model_; }

  private:
    pbm_model *model_ = nullptr;
    pbm_error error_{};
};

// A name of this process alone.
inline std::string temporary(const std::string &name) {
    return testing::TempDir() + "pbm_c_" + std::to_string(::getpid()) + "_" + name;
}

inline std::vector<std::uint8_t> read_file(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

// The bytes of a file of the ball.
inline std::vector<std::uint8_t> ball_bytes(const Options &options = {{"depth", "6"}}) {
    const std::string path = temporary("bytes.pbvg");
    pbm_error error;
    EXPECT_EQ(build_ball(options, path.c_str(), nullptr, &error), PBM_OK) << error.message;
    std::vector<std::uint8_t> bytes = read_file(path);
    std::remove(path.c_str());
    return bytes;
}

// A picture of a model with room of its own.
struct Picture {
    std::vector<std::uint8_t> pixels;
    std::vector<float> depths;
    pbm_picture api = PBM_NEW(pbm_picture);

    Picture(int width, int height)
        : pixels(static_cast<std::size_t>(4 * width * height)), depths(static_cast<std::size_t>(width * height)) {
        api.width = width;
        api.height = height;
        api.pixels = pixels.data();
        api.pixel_bytes = pixels.size();
        api.depths = depths.data();
        api.depth_count = depths.size();
    }
    Picture(const Picture &) = delete;
    Picture &operator=(const Picture &) = delete;
};

inline pbm_camera camera_of(pbm_model *model, int width, int height) {
    pbm_camera camera = PBM_NEW(pbm_camera);
    pbm_error error;
    EXPECT_EQ(pbm_default_camera(model, width, height, &camera, &error), PBM_OK) << error.message;
    return camera;
}

} // namespace pbm::test
