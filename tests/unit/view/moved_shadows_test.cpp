// Shadows of moved lights: dropped at once, baked in the background, and saved as a file has them.
#include "viewer/light/moved_shadows.h"
#include "viewer/light/scene_saver.h"

#include "pbm_bake/shadow_baker.h"
#include "pbm_format/checking/validate.h"
#include "pbm_format/writing/writer.h"
#include "system/files/file_replacement.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

namespace pbm {
namespace {

class MovedShadowsTest : public testing::Test {
  protected:
    MovedShadowsTest() {
        AttributeSet set{.lights = 2};
        for (std::size_t level = 0; level <= 5; ++level)
            set.shadow_bits[0][level] = set.shadow_bits[1][level] = level == 5 ? 1 : 4;
        Model model = test::sphere_model(5, set);
        model.parameters.lights.resize(3);
        model.parameters.lights[1].direction = {1, 0, 0};
        model.parameters.ground = {.centre = {1, 0.1F, 1}, .half_edge = 2, .material = 0, .texture = std::nullopt};
        model.images.ground_lit.assign(
            2, {.width = 64, .height = 64, .channels = 1, .texels = Bytes(std::size_t{64} * 64, 9)});
        file_ = value_of(encode_model(model, {.threads = 1}));
    }
    void SetUp() override {
        ASSERT_TRUE(replace_file(path_, file_));
        auto opened = ShownModel::open(path_, path_, {}, [] {});
        ASSERT_TRUE(opened) << opened.error().message;
        model_ = *opened;
    }
    void TearDown() override { std::filesystem::remove(path_); }

    Appearance appearance() const { return Appearance(model_->parameters()); }
    // Serves until nothing is baked any more; returns how often `serve` had news.
    static int serve_all(MovedShadows &shadows, double now) {
        int news = 0;
        for (int i = 0; i < 20000 && shadows.baking(); ++i) {
            news += shadows.serve(now) ? 1 : 0;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        return news;
    }

    const std::string path_ = testing::TempDir() + "moved_shadows_test.pbvg";
    Bytes file_;
    ShownModelPointer model_;
    ThreadPool worker_{2};
};

TEST_F(MovedShadowsTest, AreDroppedAndBakedWhereTheLightRests) {
    MovedShadows shadows(worker_, 2, kDefaultMaxMemory);
    shadows.show(model_);
    Appearance look = appearance();
    look.lights[0].intensity = {2, 2, 2};
    shadows.choose(look);
    shadows.request(look, true, 10);
    EXPECT_EQ(look.shadows, appearance().shadows); // brighter, not moved
    EXPECT_FALSE(shadows.baking() || shadows.due());

    look.lights[1].direction = {0, -1, 0};
    look.lights[2].direction = {0, -1, 0}; // casts none
    shadows.choose(look);
    shadows.request(look, true, 10);
    EXPECT_TRUE(look.shadows[0].of_file);
    EXPECT_FALSE(look.shadows[1].of_file || look.shadows[1].fresh);
    EXPECT_EQ(shadows.baking(), std::optional<std::size_t>(1));
    EXPECT_EQ(shadows.due(), std::optional(10 + MovedShadows::kRest));
    EXPECT_FALSE(shadows.serve(10)); // the light does not rest yet
    EXPECT_EQ(serve_all(shadows, 11), 1);
    shadows.choose(look);
    ASSERT_TRUE(look.shadows[1].fresh);
    EXPECT_EQ(look.shadows[1].fresh->levels.size(), 6U);
    EXPECT_TRUE(look.shadows[1].fresh->ground);
    EXPECT_FALSE(shadows.take_error());

    // As the builder bakes points.
    auto loaded = value_of(Reader::open(file_));
    const Model model = value_of(load_model(loaded));
    const Bytes expected = bake_light(ShadowCasters(model, 1), look.lights[1], {.bits = 1});
    EXPECT_EQ(stored_fractions(*look.shadows[1].fresh, 1), expected);

    look.lights[1] = appearance().lights[1]; // back to the file's place
    shadows.choose(look);
    EXPECT_TRUE(look.shadows[1].of_file);
}

TEST_F(MovedShadowsTest, TheNewestRequestWins) {
    MovedShadows shadows(worker_, 1, kDefaultMaxMemory);
    shadows.show(model_);
    Appearance look = appearance();
    for (int i = 0; i < 5; ++i) {
        look.lights[0].direction = i % 2 == 0 ? std::array<float, 3>{1, 0, 0} : std::array<float, 3>{0, 1, 0};
        look.lights[0].direction[2] = 0;
        shadows.request(look, true, i);
        shadows.serve(i + 0.5); // starts one, which the next request stops
    }
    serve_all(shadows, 100);
    ASSERT_TRUE(shadows.baked(0));
    EXPECT_EQ(shadows.baked(0)->light.direction, look.lights[0].direction);
    shadows.request(look, false, 200); // shadows are switched off
    look.lights[0].direction = {0, 0, 1};
    shadows.request(look, false, 200);
    EXPECT_FALSE(shadows.baking());
}

TEST_F(MovedShadowsTest, ThatNeedTooMuchMemoryAreRefusedOnce) {
    MovedShadows shadows(worker_, 1, 1000);
    shadows.show(model_);
    Appearance look = appearance();
    look.lights[0].direction = {0, -1, 0};
    shadows.request(look, true, 0);
    EXPECT_EQ(serve_all(shadows, 1), 0);
    const auto error = shadows.take_error();
    ASSERT_TRUE(error);
    EXPECT_EQ(error->code, ErrorCode::memory);
    EXPECT_TRUE(shadows.is_stale(0));
    EXPECT_FALSE(shadows.baking() || shadows.take_error());
    shadows.choose(look);
    EXPECT_FALSE(look.shadows[0].of_file || look.shadows[0].fresh);
}

TEST_F(MovedShadowsTest, AreSavedWithTheirLight) {
    MovedShadows shadows(worker_, 2, kDefaultMaxMemory);
    shadows.show(model_);
    SceneSave save{.path = path_,
                   .opened = Bytes(file_.begin(), file_.begin() + kHeaderBytes),
                   .appearance = appearance(),
                   .up = model_->grid().up,
                   .view = {{.position = {0, 0, 9}}},
                   .baked = {}};
    save.appearance.lights[1].direction = {0, -1, 0};
    save.appearance.materials[0].ka = 0.5F;
    const auto early = save_scene(save);
    ASSERT_FALSE(early);
    EXPECT_EQ(early.error().code, ErrorCode::usage) << early.error().message;
    shadows.request(save.appearance, true, 0);
    serve_all(shadows, 1);
    save.baked[1] = shadows.baked(1);
    const auto saved = save_scene(save);
    ASSERT_TRUE(saved) << saved.error().message;
    const auto mapped = value_of(MappedFile::open(path_));
    EXPECT_TRUE(verify(mapped.bytes()));
    auto reader = value_of(Reader::open(mapped.bytes()));
    EXPECT_EQ(reader.parameters().lights, save.appearance.lights);
    EXPECT_EQ(reader.parameters().materials, save.appearance.materials);
    EXPECT_NE(reader.metadata().find("\"view\""), std::string_view::npos);
    const Model model = value_of(load_model(reader));
    EXPECT_EQ(model.levels.back().points.shadows[1], stored_fractions(*save.baked[1]->fractions, 1));
    EXPECT_EQ(model.images.ground_lit[1], save.baked[1]->ground);
    // The picture of the window was that of the saved file, level by level.
    for (std::size_t level = 0; level < model.levels.size(); ++level) {
        const int bits = model.parameters.attributes.shadow_bits[1][level];
        Bytes scaled = model.levels[level].points.shadows[1];
        for (std::uint8_t &value : scaled)
            value = static_cast<std::uint8_t>(value * (255 / ((1 << bits) - 1)));
        EXPECT_EQ(save.baked[1]->fractions->levels[level], scaled) << level;
    }
    save.opened = *saved;
    save.appearance.materials[0].ka = 0.25F; // again: the light already stands where it should
    save.baked = {};
    EXPECT_TRUE(save_scene(save));
}

} // namespace
} // namespace pbm
