#include "system/processes/child_program.h"
#include "system/processes/this_process.h"
#include "unit/support/value_of.h"
#include "viewer/navigation/camera_control.h"
#include "viewer/pictures/avi_writer.h"
#include "viewer/pictures/frame_names.h"
#include "viewer/pictures/image_writer.h"
#include "viewer/pictures/jpeg_encoder.h"
#include "viewer/pictures/picture_file.h"
#include "viewer/pictures/video_writer.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace pbm {
namespace {

namespace fs = std::filesystem;

class Folder {
  public:
    Folder()
        : path_(fs::temp_directory_path() /
                ("pbm_video_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
                 ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
        fs::remove_all(path_);
        fs::create_directories(path_);
    }
    Folder(const Folder &) = delete;
    Folder &operator=(const Folder &) = delete;
    ~Folder() { fs::remove_all(path_); }
    std::string operator/(const std::string &name) const { return (path_ / name).string(); }
    std::size_t files() const {
        return static_cast<std::size_t>(std::distance(fs::directory_iterator(path_), fs::directory_iterator()));
    }

  private:
    fs::path path_;
};

Bytes bytes_of(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

// A ramp that depends on `shift`, so that frames differ.
Framebuffer ramp(int width, int height, int shift, std::uint8_t alpha = 255) {
    Framebuffer picture(width, height, false);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            picture
                .colour[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
                pack_rgba({static_cast<std::uint8_t>(x * 8 + shift), static_cast<std::uint8_t>(y * 8),
                           static_cast<std::uint8_t>(shift), alpha});
    return picture;
}

// Two pixels, red above blue. BMP: BGR, lower row first, rows padded to four bytes.
TEST(Bmp, TwoPixelsByteForByte) {
    Framebuffer picture(1, 2, false);
    picture.colour[0] = pack_rgba({255, 1, 2, 255});
    picture.colour[1] = pack_rgba({3, 4, 255, 255});
    const Bytes expected{'B', 'M', 62, 0, 0, 0, 0, 0, 0, 0, 54, 0,  0,   0, // file
                         40,  0,   0,  0, 1, 0, 0, 0, 2, 0, 0,  0,  1,   0, // size, width, height, planes
                         24,  0,   0,  0, 0, 0, 8, 0, 0, 0, 19, 11, 0,   0, // bits, plain, bytes, pixels per metre
                         19,  11,  0,  0, 0, 0, 0, 0, 0, 0, 0,  0,  255, 4, 3, 0, 2, 1, 255, 0};
    EXPECT_EQ(*encode_bmp(picture), expected);
}

TEST(Bmp, TransparencyHasMasksAndFourBytes) {
    Framebuffer picture(3, 1, false);
    for (std::size_t x = 0; x < 3; ++x)
        picture.colour[x] = pack_rgba({10, 20, 30, static_cast<std::uint8_t>(40 * x)});
    const Bytes file = *encode_bmp(picture);
    ASSERT_EQ(file.size(), 14U + 108 + 12);
    EXPECT_EQ(file[28], 32);
    EXPECT_EQ(file[30], 3); // compression: bit masks
    EXPECT_EQ(Bytes(file.begin() + 54, file.begin() + 70),
              (Bytes{0, 0, 255, 0, 0, 255, 0, 0, 255, 0, 0, 0, 0, 0, 0, 255}));
    EXPECT_EQ(Bytes(file.end() - 4, file.end()), (Bytes{30, 20, 10, 80}));
}

TEST(PictureForm, IsThatOfTheExtension) {
    EXPECT_EQ(*picture_form("a.b/picture"), PictureForm::png);
    EXPECT_EQ(*picture_form("a.PNG"), PictureForm::png);
    EXPECT_EQ(*picture_form("a.Bmp"), PictureForm::bmp);
    EXPECT_EQ(*picture_form("a.jpg"), PictureForm::jpeg);
    EXPECT_EQ(*picture_form("a.JPEG"), PictureForm::jpeg);
    for (const char *const other : {"a.jpx", "a.png.gz", "a.bm"}) {
        ASSERT_FALSE(picture_form(other)) << other;
        EXPECT_EQ(picture_form(other).error().code, ErrorCode::usage);
    }
}

TEST(FrameNames, NeedExactlyOneNumber) {
    EXPECT_EQ(parse_frame_names("a_%04d.png")->of(7), "a_0007.png");
    EXPECT_EQ(parse_frame_names("a_%02d.png")->of(123), "a_123.png");
    EXPECT_EQ(parse_frame_names("%d.bmp")->of(0), "0.bmp");
    for (const char *const wrong : {"a.png", "%", "%%d.png", "%4d.png", "%04.png", "%d_%d.png", "%00d.png", "%04d%.png",
                                    "%0", "%d/a.png", "a%b_%d.png", "%%%.png"})
        EXPECT_FALSE(parse_frame_names(wrong)) << wrong;
}

TEST(FrameNames, MayHaveOtherPercentSigns) {
    EXPECT_EQ(parse_frame_names("100%/tt_%04d.png")->of(7), "100%/tt_0007.png");
    EXPECT_EQ(parse_frame_names("%d/%%/%s%/%d.png")->of(7), "%d/%%/%s%/7.png");
    EXPECT_EQ(parse_frame_names("a%%b_%02d.png")->of(7), "a%b_07.png");
    EXPECT_EQ(parse_frame_names("%d%%d%%.bmp")->of(7), "7%d%.bmp");
    EXPECT_EQ(parse_frame_names("%%%d%%")->of(7), "%7%");
}

TEST(FrameRate, IsAFractionInLowestTerms) {
    const auto is = [](double fps, std::uint32_t frames, std::uint32_t seconds) {
        const FrameRate rate = frame_rate(fps);
        return rate.frames == frames && rate.seconds == seconds;
    };
    EXPECT_TRUE(is(30, 30, 1));
    EXPECT_TRUE(is(12.5, 25, 2));
    EXPECT_TRUE(is(23.976, 2997, 125));
}

TEST(Jpeg, TheSameBytesAgainAndSmallerWithLessQuality) {
    const Framebuffer picture = ramp(33, 17, 3);
    const Bytes fine = *encode_jpeg(picture, 95);
    EXPECT_EQ(fine, *encode_jpeg(picture, 95));
    EXPECT_LT(encode_jpeg(picture, 20)->size(), fine.size());
    EXPECT_EQ(Bytes(fine.begin(), fine.begin() + 3), (Bytes{0xFF, 0xD8, 0xFF}));
    EXPECT_EQ(Bytes(fine.end() - 2, fine.end()), (Bytes{0xFF, 0xD9}));
}

TEST(Jpeg, ErrorsOfTheLibraryAreReported) {
    Framebuffer picture(1, 1, false);
    picture.width = 70000; // wider than a JPEG may be: refused before a pixel is read
    const auto refused = encode_jpeg(picture, 90);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::memory);
}

TEST(Avi, EndsAtItsLimitAndLeavesNothing) {
    const Folder folder;
    const Bytes frame(1001, 7);
    auto writer_made = AviWriter::begin(folder / "a.avi", {16, 16}, {25, 1}, 10'000);
    ASSERT_TRUE(writer_made);
    AviWriter &writer = *writer_made;
    int frames = 0;
    Status status;
    while (status = writer.write(frame), status)
        ++frames;
    EXPECT_EQ(status.error().code, ErrorCode::memory);
    EXPECT_GE(frames, 8);
    {
        auto whole_made = AviWriter::begin(folder / "b.avi", {16, 16}, {25, 1}, 10'000);
        ASSERT_TRUE(whole_made);
        AviWriter &whole = *whole_made;
        for (int i = 0; i < frames; ++i)
            ASSERT_TRUE(whole.write(frame));
        ASSERT_TRUE(whole.finish());
        const Bytes file = bytes_of(folder / "b.avi");
        EXPECT_LE(file.size(), 10'000U);
        const std::uint32_t riff = file[4] + 256U * file[5] + 65536U * file[6];
        EXPECT_EQ(riff + 8, file.size());
    }
    { const AviWriter gone = std::move(*writer_made); }
    EXPECT_EQ(folder.files(), 1U);
}

// For any number of threads each frame is written once, in order.
TEST(VideoRecorder, WritesFramesInTheirOrder) {
    std::vector<Bytes> videos;
    for (const int threads : {1, 2, 5}) {
        Bytes written;
        bool finished = false;
        VideoSink sink{
            .encode = [](const Framebuffer &frame) -> Result<Bytes> { return Bytes{unpack_rgba(frame.colour[0])[2]}; },
            .write = [&](ByteView bytes) -> Status {
                written.insert(written.end(), bytes.begin(), bytes.end());
                return {};
            },
            .finish = [&]() -> Status {
                finished = true;
                return {};
            }};
        VideoRecorder recorder(std::move(sink), {4, 3}, false, threads, 1 << 20);
        for (int i = 0; i < 23; ++i) {
            recorder.canvas().colour = ramp(4, 3, i).colour;
            ASSERT_TRUE(recorder.add());
        }
        EXPECT_FALSE(finished);
        ASSERT_TRUE(recorder.finish());
        EXPECT_TRUE(finished);
        EXPECT_EQ(recorder.bytes(), 23U);
        Bytes expected;
        for (std::uint8_t i = 0; i < 23; ++i)
            expected.push_back(i);
        EXPECT_EQ(written, expected) << threads;
    }
}

TEST(VideoRecorder, TellsTheFirstErrorAndFinishesNothing) {
    int written = 0;
    VideoSink sink{.encode = [](const Framebuffer &) -> Result<Bytes> { return Bytes(1); },
                   .write = [&](ByteView) -> Status {
                       return ++written < 3 ? Status() : Status(Error{ErrorCode::io, 0, "full"});
                   },
                   .finish = [] { return usage_error("finished"); }};
    VideoRecorder recorder(std::move(sink), {4, 3}, false, 2, 1 << 20);
    Status status;
    for (int i = 0; i < 20 && status; ++i)
        status = recorder.add();
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().message, "frame 3: full");
    EXPECT_EQ(written, 3);
}

TEST(VideoSink, PicturesAreThoseOfTheirForm) {
    const Folder folder;
    for (const std::string form : {"png", "bmp", "jpg"}) {
        const VideoOptions options{.output = folder / ("f_%02d." + form)};
        ASSERT_TRUE(check_video_name(options.output));
        const VideoSink sink = value_of(open_video(options, {5, 4}));
        for (int i = 1; i <= 2; ++i) {
            const Framebuffer picture = ramp(5, 4, i, 100);
            ASSERT_TRUE(sink.write(*sink.encode(picture)));
            const std::string name = folder / ("f_0" + std::to_string(i) + "." + form);
            EXPECT_EQ(bytes_of(name), *encode_picture(picture, *picture_form(name)));
        }
        ASSERT_TRUE(sink.finish());
    }
}

TEST(VideoSink, OnlyMp4HasEvenSizes) {
    EXPECT_EQ(stored_size("a.mp4", {75, 50}), glm::ivec2(76, 50));
    EXPECT_EQ(stored_size("a.mp4", {1, 1}), glm::ivec2(2, 2));
    EXPECT_EQ(stored_size("a.mp4", {640, 480}), glm::ivec2(640, 480));
    for (const char *const other : {"a.avi", "-", "%d.png"})
        EXPECT_EQ(stored_size(other, {75, 51}), glm::ivec2(75, 51)) << other;
}

TEST(VideoNames, OfOtherFormsAreRefused) {
    for (const char *const wrong : {"", "a", "a.gif", "a.png", "a.jpg", "a_%d", "a_%d.gif", "a.mkv"}) {
        const Status status = check_video_name(wrong);
        ASSERT_FALSE(status) << wrong;
        EXPECT_EQ(status.error().code, ErrorCode::usage);
    }
    for (const char *const good : {"a.avi", "a.AVI", "a.mp4", "-", "%d.png", "a_%03d.bmp"})
        EXPECT_TRUE(check_video_name(good)) << good;
    EXPECT_TRUE(has_transparency("a_%d.png"));
    EXPECT_FALSE(has_transparency("a_%d.jpg"));
    EXPECT_EQ(video_files({.output = "a_%d.png", .frames = 9}), (std::vector<std::string>{"a_1.png", "a_9.png"}));
}

TEST(Turntable, ComesRoundToTheSameViewFromAnywhere) {
    Camera camera;
    camera.position = {1, 2, 3};
    camera.focal_point = {0.5, 0, -1};
    const glm::dvec3 axis(0, 2, 0);
    const Camera same = turntable(camera, axis, 0);
    EXPECT_EQ(same.position, camera.position);
    const Camera quarter = turntable(camera, axis, glm::half_pi<double>());
    EXPECT_NEAR(glm::length(quarter.position - glm::dvec3(4.5, 2, -1.5)), 0, 1e-12); // (0.5, 4) turns to (4, -0.5)
    const Camera round = turntable(camera, axis, glm::two_pi<double>());
    EXPECT_NEAR(glm::length(round.position - camera.position), 0, 1e-12);
    Camera above;
    above.position = {0, 5, 0};
    above.up = {0, 0, -1};
    const Camera turned = turntable(above, axis, 1.0);
    EXPECT_TRUE(is_usable(turned));
    EXPECT_EQ(turned.position, above.position);
    EXPECT_NEAR(glm::dot(turned.up, above.up), std::cos(1.0), 1e-12);
}

ByteView view(const std::string &text) { return {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()}; }

TEST(ChildProgram, TakesItsInput) {
    const Folder folder;
    auto program = ChildProgram::start({"sh", "-c", "cat > '" + (folder / "copy") + "'"});
    const std::string text(300'000, 'x');
    for (int i = 0; i < 5; ++i)
        ASSERT_TRUE(program->write(view(text)));
    ASSERT_TRUE(program->finish());
    EXPECT_EQ(fs::file_size(folder / "copy"), 5 * text.size());
}

TEST(ChildProgram, SaysWhyItFailed) {
    make_write_errors_returns();
    const auto none = ChildProgram::start({"pbm-no-such-program"});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message, "pbm-no-such-program is not installed");
    EXPECT_EQ(none.error().code, ErrorCode::memory);
    auto early = ChildProgram::start({"sh", "-c", "echo 'no \033[1m disk' >&2; echo more >&2; exit 7"});
    const std::string text(3'000'000, 'x'); // larger than the buffer of the pipe
    const Status written = early->write(view(text));
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().message, "sh failed with exit code 7: no ?[1m disk");
    auto killed = ChildProgram::start({"sh", "-c", "kill -9 $$"});
    const Status ended = killed->finish();
    ASSERT_FALSE(ended);
    EXPECT_EQ(ended.error().message, "sh was ended by signal 9");
    // The destructor ends the child instead of waiting for it.
    { auto sleeper = ChildProgram::start({"sleep", "1000"}); }
}

} // namespace
} // namespace pbm
