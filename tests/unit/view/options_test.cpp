#include "unit/render/test_model.h"
#include "viewer/options/option_values.h"
#include "viewer/options/view_options.h"
#include "viewer/pictures/picture_file.h"

#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

namespace pbm {
namespace {

namespace fs = std::filesystem;

// The value of --NAME=VALUE in a line of options.
std::string option(const std::string &line, const std::string &name) {
    std::istringstream words(line);
    for (std::string word; words >> word;)
        if (word.starts_with("--" + name + "="))
            return word.substr(name.size() + 3);
    return "absent";
}

TEST(ViewAsOptions, EveryNumberReadsBackAsItWas) {
    Camera camera;
    camera.position = {1.0 / 3, -4.3e6 + 0.1, 5e-324};
    camera.focal_point = {-0.0, 1e300, 0.1};
    camera.up = {0.1 + 0.2, 1, -7};
    ViewOptions options;
    options.view_angle = 30.1;
    const std::string line = view_as_options(camera, options, {1280, 720});
    EXPECT_EQ(*parse_vector(option(line, "camera-position")), camera.position);
    EXPECT_EQ(*parse_vector(option(line, "camera-focal-point")), camera.focal_point);
    EXPECT_EQ(*parse_vector(option(line, "camera-view-up")), camera.up);
    EXPECT_EQ(*parse_resolution(option(line, "resolution")), glm::ivec2(1280, 720));
    EXPECT_EQ(option(line, "camera-view-angle"), "30.1");
    EXPECT_EQ(option(line, "up"), "absent");
    options.up = UpAxis::z;
    EXPECT_EQ(option(view_as_options(camera, options, {1280, 720}), "up"), "z");
}

TEST(ViewAsOptions, ClipRegionsReadBackAsTheyWere) {
    Camera camera;
    EXPECT_EQ(option(camera_as_options(camera, 30), "clip-plane"), "absent");
    camera.clip = {.plane = ClipPlane{{1.0 / 3, -4.3e6 + 0.1, 2}, {0.1 + 0.2, -1, 0}},
                   .box = ClipBox{{-1, -2, -3}, {1.0 / 7, 2, 3e9}}};
    const std::string line = camera_as_options(camera, 30);
    EXPECT_EQ(*parse_clip_plane(option(line, "clip-plane")), *camera.clip.plane);
    EXPECT_EQ(*parse_clip_box(option(line, "clip-box")), *camera.clip.box);
    EXPECT_EQ(*parse_clip_box("1,5,3,4,2,6"), (ClipBox{{1, 2, 3}, {4, 5, 6}})); // any opposite corners
}

TEST(LookAsOptions, NamesOptionsThatAreNotTheDefault) {
    LookOptions look;
    RenderOptions &render = look.render;
    EXPECT_EQ(look_as_options(look), "");
    LookOptions some;
    some.classes = {{.dropped{0x40080}, .shown{4}}, false};
    EXPECT_EQ(look_as_options(some), " --drop-class=7,18 --show-class=2");
    EXPECT_EQ(fields_to_keep(some), (std::vector<std::string>{"classification"}));
    some.colour_by = ColourBy{.field = "class", .choice = {}};
    EXPECT_EQ(fields_to_keep(some), (std::vector<std::string>{"classification"}));
    some.colour_by->field = "gps_time";
    some.classes.if_there = true;
    EXPECT_EQ(fields_to_keep(some), (std::vector<std::string>{"gps_time"}));
    some.colour_by->field = "height";
    EXPECT_TRUE(fields_to_keep(some).empty());
    render.shadows = render.ground = false;
    look.quality = Quality::fine;
    look.samples = 3;
    look.depth_cue = DepthCue::ambient_occlusion;
    look.lights_follow = LightsFollow::model;
    render.shading = Shading::unlit;
    look.finish = {.exposure = -1.5, .tone = Tone::filmic};
    EXPECT_EQ(look_as_options(look),
              " --no-shadows --no-ground --shading=unlit --light-follows=model --exposure=-1.5 --tone=filmic "
              "--depth-cue=ambient-occlusion "
              "--quality=fine --samples=3");
    LookOptions fewer;
    fewer.samples = 3;
    EXPECT_EQ(look_as_options(fewer), " --samples=3");
    fewer.quality = Quality::fast;
    EXPECT_EQ(look_as_options(fewer), " --quality=fast");
    for (int value = 0; value < 256; ++value) {
        const auto byte = static_cast<std::uint8_t>(value);
        render.background = {byte, 7, static_cast<std::uint8_t>(255 - byte), 255};
        render.background_below = value % 2 == 0 ? std::optional(Rgba8{1, byte, 2, 255}) : std::nullopt;
        RenderOptions read;
        EXPECT_TRUE(parse_background(option(look_as_options(look), "background-color"), read));
        EXPECT_EQ(read.background, render.background);
        EXPECT_EQ(read.background_below, render.background_below);
    }
}

TEST(LookOf, IsFineForStillPicturesUnlessTheLookSaysOtherwise) {
    const auto quality = [](Motion motion, Quality asked) {
        LookOptions look;
        look.quality = asked;
        return look_of(motion, look).quality;
    };
    EXPECT_EQ(quality(Motion::still, LookOptions{}.quality), Quality::fine);
    EXPECT_EQ(quality(Motion::moving, LookOptions{}.quality), Quality::fast);
    for (const Quality asked : {Quality::fast, Quality::fine})
        for (const Motion motion : {Motion::still, Motion::moving})
            EXPECT_EQ(quality(motion, asked), asked);
}

TEST(ParseFrameRate, IsOneTo240OrNone) {
    EXPECT_EQ(*parse_frame_rate("0"), 0);
    EXPECT_EQ(*parse_frame_rate("1"), 1);
    EXPECT_EQ(*parse_frame_rate("23.976"), 23.976);
    EXPECT_EQ(*parse_frame_rate("240"), 240);
    for (const char *const wrong : {"", "0.5", "-1", "241", "nan", "30fps", "30,60", "1e9"}) {
        const auto refused = parse_frame_rate(wrong);
        ASSERT_FALSE(refused) << wrong;
        EXPECT_EQ(refused.error().code, ErrorCode::usage);
    }
}

TEST(ChooseCamera, UsesTheOptionsOfTheCommandLine) {
    const Model wall = make_wall(4, 3);
    const Extent extent = find_extent(wall);
    Grid grid = wall.parameters.grid;
    grid.up = UpAxis::z;
    ViewOptions options;
    const Camera given = *choose_camera(options, extent, grid, {100, 100});
    const Camera expected = default_camera(extent, UpAxis::z, 100, 100, glm::radians(30.0));
    EXPECT_EQ(given.position, expected.position);
    EXPECT_EQ(given.up, glm::dvec3(0, 0, 1));
    options.up = UpAxis::x;
    EXPECT_EQ(choose_camera(options, extent, grid, {100, 100})->up, glm::dvec3(1, 0, 0));
    EXPECT_EQ(choose_turntable(options, extent, grid, {100, 100})->up, glm::dvec3(1, 0, 0));
    options.position = glm::dvec3(7, 8, 9);
    const Camera moved = *choose_camera(options, extent, grid, {100, 100});
    EXPECT_EQ(moved.position, glm::dvec3(7, 8, 9));
    EXPECT_EQ(moved.focal_point, extent.sphere.centre);
    EXPECT_EQ(choose_turntable(options, extent, grid, {100, 100})->position, moved.position);
    options.focal_point = options.position;
    const auto blind = choose_camera(options, extent, grid, {100, 100});
    ASSERT_FALSE(blind);
    EXPECT_EQ(blind.error().code, ErrorCode::usage);
}

TEST(ChooseCamera, RefusesGridsSoFarFromTheOriginThatCoordinatesRoundOrOverflow) {
    const auto extent_at = [](const glm::dvec3 &centre, double radius) {
        return Extent{.sphere = {centre, radius}, .corners = {centre - radius, centre + radius}};
    };
    for (const auto &[centre, radius] :
         std::initializer_list<std::pair<double, double>>{{1e308, 1e307}, {1e308, 2}, {-1e200, 1e199}, {1e9, 1e-6}})
        for (const auto &choose : {choose_camera, choose_turntable}) {
            const auto refused = choose({}, extent_at({0, 0, centre}, radius), Grid{}, {100, 100});
            ASSERT_FALSE(refused) << centre;
            EXPECT_EQ(refused.error().code, ErrorCode::unsupported_feature) << centre;
            EXPECT_NE(refused.error().message.find("the grid reaches"), std::string::npos);
        }
    for (const double centre : {0.0, 8.5e6, -1e12})
        EXPECT_TRUE(choose_camera({}, extent_at({centre, 0, 0}, 1), Grid{}, {100, 100})) << centre;
}

TEST(MaxErrorOf, IsThatOfTheCommandLineOrOfTheQuality) {
    ViewOptions options;
    const glm::ivec2 size(1280, 720), small(160, 90);
    EXPECT_EQ(max_error_of(options, size, Quality::automatic, Motion::still), kFineMaxError);
    EXPECT_EQ(max_error_of(options, size, Quality::automatic, Motion::moving), kFastMaxError);
    EXPECT_EQ(max_error_of(options, size, Quality::fine, Motion::moving), kFineMaxError);
    EXPECT_EQ(max_error_of(options, size, Quality::fast, Motion::still), kFastMaxError);
    EXPECT_EQ(max_error_of(options, {3840, 2160}, Quality::fine, Motion::still), kFineMaxError);
    EXPECT_EQ(max_error_of(options, small, Quality::fast, Motion::still), kFastMaxError);
    EXPECT_DOUBLE_EQ(max_error_of(options, small, Quality::fine, Motion::still), kFineMaxError / 8);
    EXPECT_EQ(detail_as_options(options), "");
    options.max_error = 0.5;
    for (const Quality quality : {Quality::automatic, Quality::fine, Quality::fast})
        for (const Motion motion : {Motion::still, Motion::moving})
            EXPECT_EQ(max_error_of(options, small, quality, motion), 0.5);
    EXPECT_EQ(detail_as_options(options), " --max-error=0.5");
}

TEST(CheckPictureMemory, RefusesPicturesThatTakeMoreThanGranted) {
    ViewOptions options;
    EXPECT_TRUE(check_picture_memory(options));
    options.load.max_memory = 1280 * 720 * 16;
    for (const Quality quality : {Quality::automatic, Quality::fine}) { // they accumulate samples
        options.look.quality = quality;
        EXPECT_FALSE(check_picture_memory(options));
    }
    options.look.quality = Quality::fast;
    EXPECT_TRUE(check_picture_memory(options));
    options.load.max_memory = 1280 * 720 * 16 - 1;
    const Status refused = check_picture_memory(options);
    ASSERT_FALSE(refused);
    EXPECT_EQ(exit_code(refused.error().code), 4);
}

class SavePicture : public testing::Test {
  protected:
    void SetUp() override {
        const testing::TestInfo *const test = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::path(testing::TempDir()) / (std::string("pbm_save_picture_") + test->name());
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    static std::string text_of(const fs::path &path) {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    fs::path folder_;
    Framebuffer picture_{4, 3};
};

TEST_F(SavePicture, TakesTheFirstNumberThatIsFree) {
    std::ofstream(folder_ / "lion-2.png") << "precious";
    EXPECT_EQ(*save_picture(folder_, "lion", picture_), (folder_ / "lion-1.png").string());
    EXPECT_EQ(*save_picture(folder_, "lion", picture_), (folder_ / "lion-3.png").string());
    EXPECT_EQ(text_of(folder_ / "lion-2.png"), "precious");
    EXPECT_EQ(text_of(folder_ / "lion-1.png").substr(1, 3), "PNG");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 3);
}

TEST_F(SavePicture, SaysWhichFileCannotBeWritten) {
    const auto refused = save_picture(folder_ / "nowhere", "lion", picture_);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::io);
    EXPECT_NE(refused.error().message.find("lion-1.png: No such file"), std::string::npos) << refused.error().message;
}

TEST(ColourBy, IsReadAsItIsWritten) {
    for (const char *text : {"intensity", "intensity,0,255", "intensity,-1.5,2,grey", "a,b", "class,classes"}) {
        const Result<ColourBy> by = parse_colour_by(text);
        ASSERT_TRUE(by) << text;
        EXPECT_EQ(colour_by_text(*by), text);
    }
    EXPECT_EQ(parse_colour_by("a,b")->field, "a,b");
    for (const char *text : {"", ",0,1", "intensity,5", "intensity,2,1", "class,0,1,classes", ",grey"})
        EXPECT_FALSE(parse_colour_by(text)) << text;
}

} // namespace
} // namespace pbm
