// Pictures for programs that compose pictures: what layers say of the model, and that OpenEXR reads the same.
#include "unit/render/fast_test_model.h"
#include "unit/support/value_of.h"
#include "viewer/pictures/exr_writer.h"
#include "viewer/scene/painter.h"

#include <gtest/gtest.h>

#ifdef PBM_TEST_OPENEXR
#include <OpenEXR/openexr.h>
#endif

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {
namespace {

constexpr glm::ivec2 kSize{90, 70};
const glm::dvec3 kMiddle(0, -1, -2); // of smooth_ball
constexpr double kRadius = 0.9, kVoxel = 2.0 / 64;

// A ball with colours and three materials, in a file, and its painter.
class LayersOfABall : public testing::Test {
  protected:
    void SetUp() override {
        ball_ = test::smooth_ball(6, {.colour = ColourFormat::rgb888, .material = true});
        path_ = (std::filesystem::path(testing::TempDir()) / "pbm_layers.pbvg").string();
        const Bytes file = value_of(encode_model(ball_, {.chunk_points = 512, .threads = 1}));
        std::ofstream(path_, std::ios::binary)
            .write(reinterpret_cast<const char *>(file.data()), static_cast<std::streamsize>(file.size()));
        scene_ = value_of(open_scene(path_, {.threads = 1}));
        painter_.emplace(*scene_, 1);
        camera_.focal_point = kMiddle;
        camera_.position = kMiddle + glm::dvec3(1, 0.5, 4);
        look_.emplace(LookOptions{}, scene_->model.reader().parameters(), UpAxis::y);
        look_->options.render = {.background = {0, 0, 0, 0}, .shading = Shading::unlit};
    }
    void TearDown() override { std::filesystem::remove(path_); }

    PictureLayers layers(Quality quality, double max_error = 0.1) {
        look_->options.quality = quality;
        detail_ = value_of(
            scene_->model.load({.camera = camera_, .width = kSize.x, .height = kSize.y, .max_error = max_error}));
        RenderStatistics drawn;
        PictureLayers made = painter_->draw_layers(detail_.runs, camera_, *look_, Motion::still, kSize, drawn);
        EXPECT_GT(drawn.drawn_points, 100U);
        return made;
    }
    Framebuffer picture() {
        Framebuffer target(kSize.x, kSize.y, true);
        painter_->draw(detail_.runs, camera_, *look_, Motion::still, target);
        return target;
    }

    Model ball_;
    std::string path_;
    std::unique_ptr<StreamedScene> scene_;
    std::optional<Painter> painter_;
    std::optional<Look> look_;
    Camera camera_;
    Detail detail_; // of the last picture
};

TEST_F(LayersOfABall, NameThePointThatEachPixelShows) {
    for (const double max_error : {0.1, 6.0}) {
        const PictureLayers made = layers(Quality::fast, max_error);
        const Framebuffer drawn = picture();
        std::size_t shown = 0;
        for (std::size_t at = 0; at < drawn.pixels(); ++at) {
            const PointNumbers &numbers = made.numbers[at];
            EXPECT_EQ(made.depth[at], drawn.depth[at]);
            EXPECT_EQ(numbers.point == 0, drawn.colour[at] >> 24 == 0);
            if (numbers.point == 0)
                continue;
            ++shown;
            EXPECT_EQ(numbers.level<6, max_error> 1);
            const PointAttributes &points = ball_.levels[numbers.level].points;
            const std::size_t point = numbers.point - 1;
            ASSERT_LT(point, points.size());
            EXPECT_EQ(numbers.material, points.materials[point]);
            const Rgb8 colour = point_colour(points.colours.data(), point, ColourFormat::rgb888);
            EXPECT_EQ(drawn.colour[at], pack_rgb(colour) | 0xFF000000U);
            const UnitVector &normal = normal_table()[points.normals[point] & kNormalIndexMask];
            const glm::dvec3 place(made.position[at][0], made.position[at][1], made.position[at][2]);
            for (std::size_t axis = 0; axis < 3; ++axis)
                EXPECT_NEAR(made.normal[at][axis], normal[axis], 1e-6);
            EXPECT_NEAR(glm::length(place - kMiddle), kRadius, max_error > 1 ? 8 * kVoxel : 2 * kVoxel);
        }
        EXPECT_GT(shown, 1000U);
    }
}

// Premultiplied and linear: the same picture as the one of 8 bits.
TEST_F(LayersOfABall, HaveTheColoursOfThePicture) {
    const auto to_srgb = [](float linear) {
        return 255 * (linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F);
    };
    for (const Quality quality : {Quality::fast, Quality::fine}) {
        const PictureLayers made = layers(quality);
        const Framebuffer drawn = picture();
        std::size_t partial = 0;
        for (std::size_t at = 0; at < drawn.pixels(); ++at) {
            const Float4 &colour = made.colour[at];
            const Rgba8 expected = unpack_rgba(drawn.colour[at]);
            EXPECT_NEAR(255 * colour[3], expected[3], 0.51);
            partial += expected[3] > 0 && expected[3] < 255;
            for (int c = 0; c < 3 && colour[3] > 0; ++c)
                EXPECT_NEAR(to_srgb(colour[c] / colour[3]), expected[static_cast<std::size_t>(c)], 1);
        }
        EXPECT_EQ(partial > 50, quality == Quality::fine);
    }
}

#ifdef PBM_TEST_OPENEXR

// All channels of a file as floats or integers of 4 bytes, by name.
std::map<std::string, std::vector<std::uint32_t>> read_exr(const std::string &path) {
    std::map<std::string, std::vector<std::uint32_t>> channels;
    exr_context_t file = nullptr;
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    EXPECT_EQ(exr_start_read(&file, path.c_str(), &settings), EXR_ERR_SUCCESS);
    exr_attr_box2i_t window;
    EXPECT_EQ(exr_get_data_window(file, 0, &window), EXR_ERR_SUCCESS);
    EXPECT_EQ(window.max.x + 1, kSize.x);
    EXPECT_EQ(window.max.y + 1, kSize.y);
    std::int32_t rows = 0;
    EXPECT_EQ(exr_get_scanlines_per_chunk(file, 0, &rows), EXR_ERR_SUCCESS);
    exr_decode_pipeline_t pipeline{};
    for (int y = 0; y < kSize.y; y += rows) {
        exr_chunk_info_t chunk;
        EXPECT_EQ(exr_read_scanline_chunk_info(file, 0, y, &chunk), EXR_ERR_SUCCESS);
        EXPECT_EQ(y == 0 ? exr_decoding_initialize(file, 0, &chunk, &pipeline)
                         : exr_decoding_update(file, 0, &chunk, &pipeline),
                  EXR_ERR_SUCCESS);
        for (int i = 0; i < pipeline.channel_count; ++i) {
            exr_coding_channel_info_t &channel = pipeline.channels[i];
            auto &values = channels[channel.channel_name];
            values.resize(static_cast<std::size_t>(kSize.x * kSize.y));
            channel.user_bytes_per_element = 4;
            channel.user_data_type = channel.data_type == EXR_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
            channel.user_pixel_stride = 4;
            channel.user_line_stride = 4 * kSize.x;
            channel.decode_to_ptr =
                reinterpret_cast<std::uint8_t *>(values.data() + static_cast<std::size_t>(y * kSize.x));
        }
        if (y == 0) {
            EXPECT_EQ(exr_decoding_choose_default_routines(file, 0, &pipeline), EXR_ERR_SUCCESS);
        }
        EXPECT_EQ(exr_decoding_run(file, 0, &pipeline), EXR_ERR_SUCCESS);
    }
    exr_decoding_destroy(file, &pipeline);
    exr_finish(&file);
    return channels;
}

TEST_F(LayersOfABall, AreReadBackByOpenExr) {
    const PictureLayers made = layers(Quality::fine);
    const Bytes file = value_of(encode_exr(made));
    EXPECT_EQ(file, value_of(encode_exr(made)));
    const std::string path = path_ + ".exr";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char *>(file.data()), static_cast<std::streamsize>(file.size()));
    auto channels = read_exr(path);
    std::filesystem::remove(path);
    EXPECT_EQ(channels.size(), 14U);
    const auto number = [&](const char *name, std::size_t at) { return std::bit_cast<float>(channels.at(name)[at]); };
    for (std::size_t at = 0; at < made.colour.size(); ++at) {
        int c = 0;
        for (const char *const name : {"R", "G", "B", "A"}) {
            const float exact = made.colour[at][c++];
            EXPECT_NEAR(number(name, at), exact, exact / 1024 + 1e-7F);
        }
        EXPECT_EQ(number("Z", at), std::isfinite(made.depth[at]) ? made.depth[at] : 1e10F);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::string letter(1, "XYZ"[axis]);
            EXPECT_EQ(number(("P." + letter).c_str(), at), made.position[at][axis]);
            EXPECT_EQ(number(("N." + letter).c_str(), at), made.normal[at][axis]);
        }
        EXPECT_EQ(channels.at("level.X")[at], made.numbers[at].level);
        EXPECT_EQ(channels.at("material.X")[at], made.numbers[at].material);
        EXPECT_EQ(channels.at("point.X")[at], made.numbers[at].point);
    }
}

#else

TEST(Exr, SaysThatOpenExrIsMissing) {
    const auto made = encode_exr(PictureLayers(2, 2));
    ASSERT_FALSE(made);
    EXPECT_NE(made.error().message.find("OpenEXR"), std::string::npos);
}

#endif

} // namespace
} // namespace pbm
