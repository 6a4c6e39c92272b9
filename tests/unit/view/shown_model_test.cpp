#include "pbm_format/writing/writer.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"
#include "viewer/pictures/picture_file.h"
#include "viewer/scene/damage_search.h"
#include "viewer/scene/picture_saver.h"
#include "viewer/scene/shown_model.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

namespace pbm {
namespace {

namespace fs = std::filesystem;

// Waits until `done`; false if that takes too long.
template <class Done> bool wait_for(Done &&done) {
    for (int i = 0; i < 20000; ++i) {
        if (done())
            return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

constexpr glm::ivec2 kSize{320, 200};

// Runs in a temporary folder, where pictures are saved.
class ShownModelTest : public testing::Test {
  protected:
    void SetUp() override {
        const testing::TestInfo *const test = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::path(testing::TempDir()) / (std::string("pbm_shown_model_") + test->name());
        before_ = fs::current_path();
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        fs::current_path(folder_);
        options_.resolution = kSize;
        options_.max_error = 2;
        options_.load.threads = 2;
    }
    void TearDown() override {
        fs::current_path(before_);
        fs::remove_all(folder_);
    }

    static const Bytes &file() {
        static const Bytes bytes =
            value_of(encode_model(test::sphere_model(8, {}), {.chunk_points = 512, .threads = 1}));
        return bytes;
    }
    static void write(const Bytes &bytes) {
        std::ofstream("ball.pbvg", std::ios::binary)
            .write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
    static Bytes read(const fs::path &path) {
        std::ifstream stream(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), {}};
    }
    ShownModelPointer open() {
        auto model = ShownModel::open("ball.pbvg", "ball.pbvg", options_, [this] { ++wakes_; });
        EXPECT_TRUE(model.ok()) << model.error().message;
        return *model;
    }
    DetailView view(const ShownModel &model) const {
        return model.view(value_of(choose_camera(options_, model.extent(), model.grid(), kSize)), kSize,
                          options_.max_error.value_or(kFastMaxError));
    }
    // The picture with all needed chunks loaded.
    Framebuffer exact_picture(ShownModel &model) const {
        Framebuffer picture(kSize.x, kSize.y);
        model.draw_now(value_of(model.streamed().load(view(model))), view(model), model.first_look(), picture);
        return picture;
    }

    ViewOptions options_;
    std::atomic<int> wakes_ = 0;

  private:
    fs::path folder_, before_;
};

TEST_F(ShownModelTest, LoadsItsFirstPictureUnasked) {
    write(file());
    const ShownModelPointer model = open();
    EXPECT_EQ(model->depth(), 8);
    EXPECT_TRUE(wait_for([&] { return model->streamed().choose(view(*model)).missing.empty(); }));
    EXPECT_TRUE(wait_for([&] { return model->take_arrivals(); }));
    EXPECT_GE(wakes_, 1);
    Framebuffer shown(kSize.x, kSize.y), behind(kSize.x, kSize.y);
    const Detail detail = model->streamed().choose(view(*model));
    const PictureStatistics drawn = model->draw_now(detail, view(*model), model->first_look(), shown);
    EXPECT_EQ(drawn.missing, 0U);
    EXPECT_EQ(drawn.error, options_.max_error);
    EXPECT_GE(drawn.drawn.level, drawn.coarsest_level);
    EXPECT_GT(drawn.drawn.drawn_points, 1000U);
    model->draw_in_background(detail, view(*model), model->first_look(), behind);
    EXPECT_EQ(shown.colour, behind.colour);
}

TEST_F(ShownModelTest, DrawsItsFirstPictureBeforeThereIsAWindow) {
    write(file());
    const ShownModelPointer model = open();
    model->draw_first([&] { return wait_for([&] { return model->has_arrivals(); }); });
    const auto first = model->take_first();
    ASSERT_TRUE(first);
    EXPECT_FALSE(model->take_first());
    EXPECT_EQ(first->view, view(*model));
    EXPECT_EQ(first->drawn.missing, 0U);
    EXPECT_EQ(first->pixels.colour, exact_picture(*model).colour);

    // A window that is there earlier, or that shows another camera, does not wait.
    const ShownModelPointer other = open();
    bool has_waited = false;
    other->draw_first([&] {
        has_waited = true;
        return false;
    });
    EXPECT_NE(other->take_first().has_value(), has_waited);
    options_.view = "entrance";
    const ShownModelPointer named = open();
    named->draw_first([&] { return wait_for([&] { return named->has_arrivals(); }); });
    EXPECT_FALSE(named->take_first());
}

TEST_F(ShownModelTest, EditsShowAtOnceAndGoBack) {
    write(file());
    const ShownModelPointer model = open();
    const Detail detail = value_of(model->streamed().load(view(*model)));
    Framebuffer first = exact_picture(*model), edited(kSize.x, kSize.y), again(kSize.x, kSize.y);
    Look look = *model->first_look();
    look.appearance.lights.front().intensity = {0.1F, 0.5F, 0.1F};
    look.appearance.materials.front().kd = 0.9F;
    const auto pointer = std::make_shared<const Look>(look);
    model->draw_now(detail, view(*model), pointer, edited);
    EXPECT_NE(first.colour, edited.colour);
    model->draw_in_background(detail, view(*model), pointer, again);
    EXPECT_EQ(edited.colour, again.colour);
    model->draw_now(detail, view(*model), model->first_look(), again);
    EXPECT_EQ(first.colour, again.colour);
}

TEST_F(ShownModelTest, DepthCuesNeedNoDepthsOfTheTarget) {
    write(file());
    const ShownModelPointer model = open();
    const Detail detail = value_of(model->streamed().load(view(*model)));
    const Framebuffer plain = exact_picture(*model);
    for (const DepthCue cue : {DepthCue::eye_dome, DepthCue::ambient_occlusion})
        for (const Quality quality : {Quality::fast, Quality::fine}) {
            Look look = *model->first_look();
            look.options.depth_cue = cue;
            look.options.quality = quality;
            look.options.samples = 2;
            Framebuffer with(kSize.x, kSize.y, true), without(kSize.x, kSize.y, false);
            model->draw_still(detail, view(*model), std::make_shared<Look>(look), with);
            model->draw_still(detail, view(*model), std::make_shared<Look>(look), without);
            EXPECT_TRUE(std::equal(without.colour.begin(),
                                   without.colour.begin() + static_cast<std::ptrdiff_t>(without.pixels()),
                                   with.colour.begin()));
            EXPECT_NE(with.colour, plain.colour);
        }
}

TEST_F(ShownModelTest, IsFineAtRestAndFastInMotionUnlessTheLookSaysOtherwise) {
    write(file());
    const ShownModelPointer model = open();
    const Detail detail = value_of(model->streamed().load(view(*model)));
    const Framebuffer fast = exact_picture(*model);
    for (const Quality quality : {Quality::automatic, Quality::fast, Quality::fine}) {
        Look look = *model->first_look();
        look.options.quality = quality;
        look.options.samples = 2;
        const auto pointer = std::make_shared<const Look>(look);
        Framebuffer picture(kSize.x, kSize.y);
        model->draw_still(detail, view(*model), pointer, picture);
        EXPECT_EQ(picture.colour == fast.colour, quality == Quality::fast);
        model->draw_frame(detail, view(*model), pointer, picture);
        EXPECT_EQ(picture.colour == fast.colour, quality != Quality::fine);
        model->draw_in_background(detail, view(*model), pointer, picture);
        EXPECT_EQ(picture.colour, fast.colour);
    }
}

// The final picture of a window equals that of a program without a window.
TEST_F(ShownModelTest, SampleBySampleIsTheWholeFinePicture) {
    write(file());
    const ShownModelPointer model = open();
    const Detail detail = value_of(model->streamed().load(view(*model)));
    for (const DepthCue cue : {DepthCue::none, DepthCue::eye_dome}) {
        Look look = *model->first_look();
        look.options.quality = Quality::fine;
        look.options.samples = 3;
        look.options.depth_cue = cue;
        const auto pointer = std::make_shared<const Look>(look);
        Framebuffer whole(kSize.x, kSize.y, false), shown(kSize.x, kSize.y, false);
        model->draw_still(detail, view(*model), pointer, whole);
        model->begin_fine(detail, view(*model), pointer, Framebuffer(kSize.x, kSize.y));
        for (int i = 0; i < 3; ++i) {
            model->add_samples(detail, view(*model), 1, shown);
            EXPECT_EQ(shown.colour == whole.colour, i == 2) << i;
        }
        Framebuffer fast(kSize.x, kSize.y, false);
        model->draw_now(detail, view(*model), pointer, fast);
        EXPECT_NE(fast.colour, whole.colour);
    }
}

TEST_F(ShownModelTest, WakesOnceUntilItsEventsAreRead) {
    write(file());
    const ShownModelPointer model = open();
    EXPECT_TRUE(wait_for([&] { return !model->streamed().is_loading() && model->has_arrivals(); }));
    EXPECT_EQ(wakes_, 1);
    DetailView near = view(*model);
    near.max_error = 0.5;
    EXPECT_TRUE(model->take_arrivals());
    EXPECT_FALSE(model->take_arrivals());
    model->streamed().request(model->streamed().choose(near).missing);
    EXPECT_TRUE(wait_for([&] { return model->has_arrivals(); }));
    EXPECT_TRUE(wait_for([&] { return wakes_ == 2; }));
}

TEST_F(ShownModelTest, SaysHowCoarseAPictureIs) {
    write(file());
    options_.max_error = 64; // a coarse error: opening the file loads all that it needs
    const ShownModelPointer model = open();
    DetailView near = view(*model);
    near.max_error = 0.5;
    near.camera.position = model->bounds().centre + glm::dvec3(0, 0, 1.1 * model->bounds().radius);
    near.camera.focal_point = model->bounds().centre;
    Framebuffer picture(kSize.x, kSize.y);
    const Detail detail = model->streamed().choose(near);
    ASSERT_FALSE(detail.missing.empty());
    const PictureStatistics drawn = model->draw_now(detail, near, model->first_look(), picture);
    EXPECT_EQ(drawn.missing, detail.missing.size());
    EXPECT_GT(drawn.error, near.max_error);
    EXPECT_NEAR(drawn.error, 2 * detail.missing[0].error, 1e-9);
    EXPECT_LT(drawn.coarsest_level, 8);
}

TEST_F(ShownModelTest, RefusesFilesThatAreNoModels) {
    const auto none = ShownModel::open("ball.pbvg", "ball.pbvg", options_, [] {});
    ASSERT_FALSE(none.ok());
    EXPECT_EQ(none.error().code, ErrorCode::io);
    Bytes damaged = file();
    Reader reader = value_of(Reader::open(damaged));
    damaged[value_of(reader.directory(5))->chunks[0].offset] ^= 1;
    write(damaged);
    const auto refused = ShownModel::open("ball.pbvg", "ball.pbvg", options_, [] {});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_hash);
}

TEST_F(ShownModelTest, KeepsTheNameOfTheScan) {
    write(file());
    const auto model = ShownModel::open("scan.ply", "ball.pbvg", options_, [] {});
    ASSERT_TRUE(model.ok());
    EXPECT_EQ((*model)->path(), "scan.ply");
    EXPECT_EQ((*model)->bytes().size(), file().size());
}

TEST_F(ShownModelTest, DamageIsFoundInEveryChunkAndSection) {
    EXPECT_TRUE(find_damage(file(), {}).empty());
    Bytes damaged = file();
    Reader reader = value_of(Reader::open(file()));
    std::vector<std::uint64_t> offsets;
    for (int level = reader.depth(); level > reader.depth() - 2; --level)
        for (const ChunkEntry &chunk : value_of(reader.directory(level))->chunks)
            offsets.push_back(chunk.offset);
    for (const std::uint64_t offset : offsets) {
        damaged[offset] ^= 1;
        const std::vector<Error> found = find_damage(damaged, {});
        ASSERT_EQ(found.size(), 1U);
        EXPECT_EQ(found[0].code, ErrorCode::bad_hash);
        EXPECT_EQ(found[0].offset, offset);
        EXPECT_EQ(found[0].rule, "5.6.4");
        damaged[offset] ^= 1;
    }
    for (const std::uint64_t offset : offsets)
        damaged[offset] ^= 1;
    EXPECT_EQ(find_damage(damaged, {}).size(), std::min(kMaxDamageFound, offsets.size()));
    std::stop_source stop;
    stop.request_stop();
    EXPECT_TRUE(find_damage(damaged, stop.get_token()).empty());
    damaged = file();
    const FileRange directory = reader.directory_range(reader.depth());
    damaged[directory.offset + directory.bytes - 1] ^= 1;
    const std::vector<Error> found = find_damage(damaged, {});
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].rule, "3.2.14");
}

TEST_F(ShownModelTest, IsDestroyedInTheBackground) {
    write(file());
    ThreadPool background(2);
    ShownModelPointer model = open();
    const std::weak_ptr<ShownModel> watched = model;
    std::promise<void> gate;
    background.post([&] { gate.get_future().wait(); });
    destroy_in(background, std::move(model));
    EXPECT_FALSE(watched.expired());
    gate.set_value();
    EXPECT_TRUE(wait_for([&] { return watched.expired(); }));
}

TEST_F(ShownModelTest, SavesTheExactPictureHoweverLittleIsLoaded) {
    write(file());
    options_.look.quality = Quality::fast; // as exact_picture
    ThreadPool background(2);
    const ShownModelPointer model = open();
    PictureSaver saver(background);
    saver.add(model, view(*model), model->first_look());
    EXPECT_TRUE(saver.is_waiting());
    std::vector<Result<std::string>> saved;
    EXPECT_TRUE(wait_for([&] {
        saver.serve();
        saved = saver.take_done(false);
        return !saved.empty();
    }));
    EXPECT_FALSE(saver.is_waiting());
    ASSERT_EQ(saved.size(), 1U);
    ASSERT_TRUE(saved[0].ok()) << saved[0].error().message;
    EXPECT_EQ(*saved[0], "ball-1.png");
    const ShownModelPointer other = open();
    EXPECT_EQ(*save_picture({}, "expected", exact_picture(*other)), "expected-1.png");
    EXPECT_EQ(read("ball-1.png"), read("expected-1.png"));
}

TEST_F(ShownModelTest, SavesAllWhenItIsOver) {
    write(file());
    ThreadPool background(2);
    const ShownModelPointer model = open();
    PictureSaver saver(background);
    for (int i = 0; i < 3; ++i)
        saver.add(model, view(*model), model->first_look());
    const auto saved = saver.take_done(true);
    ASSERT_EQ(saved.size(), 3U);
    for (const Result<std::string> &name : saved)
        EXPECT_TRUE(name.ok());
    EXPECT_EQ(read("ball-1.png"), read("ball-3.png"));
}

// A picture that exceeds the memory limit is refused; a smaller one is saved afterwards.
TEST_F(ShownModelTest, SavesWithinItsMemory) {
    write(file());
    const ShownModelPointer probe = open();
    EXPECT_TRUE(wait_for([&] { return !probe->streamed().is_loading(); }));
    options_.load.max_memory = probe->streamed().statistics().memory + 1000;
    ThreadPool background(2);
    const ShownModelPointer model = open();
    DetailView finer = view(*model);
    finer.max_error = 0.5;
    PictureSaver saver(background);
    saver.add(model, finer, model->first_look());
    saver.add(model, view(*model), model->first_look());
    std::vector<Result<std::string>> saved;
    EXPECT_TRUE(wait_for([&] {
        saver.serve();
        for (Result<std::string> &name : saver.take_done(false))
            saved.push_back(std::move(name));
        return saved.size() == 2;
    }));
    ASSERT_FALSE(saved[0].ok());
    EXPECT_EQ(saved[0].error().code, ErrorCode::memory);
    EXPECT_TRUE(saved[1].ok()) << saved[1].error().message;
    EXPECT_LE(model->streamed().statistics().memory, options_.load.max_memory);
}

} // namespace
} // namespace pbm
