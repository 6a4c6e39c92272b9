#include "viewer/navigation/saved_views.h"

#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace pbm {
namespace {

namespace fs = std::filesystem;

class SavedViewsTest : public testing::Test {
  protected:
    void SetUp() override {
        const testing::TestInfo *const test = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::path(testing::TempDir()) / (std::string("pbm_saved_views_") + test->name());
        fs::remove_all(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    std::string file() const { return (folder_ / "pbm" / "views").string(); }
    static SavedView view(double x) {
        SavedView saved{.camera = {}, .view_angle = 30.1};
        saved.camera.position = {x, 1.0 / 3, 8.5e6 + 0.1};
        saved.camera.up = {0.1, 0.9, 0};
        saved.camera.view_angle = glm::radians(30.1);
        saved.camera.orthographic = x > 1;
        return saved;
    }

    fs::path folder_;
};

TEST_F(SavedViewsTest, AreKeptExactlyForEachModelAndNumber) {
    const SavedViews views(file());
    EXPECT_FALSE(views.find("/scans/a.pbvg", 6));
    for (const auto &[path, number, x] : {std::tuple("/scans/a.pbvg", 6, 1.0), std::tuple("/scans/a.pbvg", 7, 2.0),
                                          std::tuple("/scans/b c\td.pbvg", 6, 3.0), std::tuple("relative.pbvg", 9, 4.0),
                                          std::tuple("/scans/a.pbvg", 6, 5.0)}) // replaces the first
        ASSERT_TRUE(views.save(path, number, view(x)));
    const SavedViews next_session(file());
    for (const auto &[path, number, x] :
         {std::tuple("/scans/a.pbvg", 6, 5.0), std::tuple("/scans/a.pbvg", 7, 2.0),
          std::tuple("/scans/b c\td.pbvg", 6, 3.0), std::tuple("./relative.pbvg", 9, 4.0)}) {
        const auto found = next_session.find(path, number);
        ASSERT_TRUE(found) << path << number;
        EXPECT_EQ(found->camera, view(x).camera) << path << number;
        EXPECT_EQ(found->view_angle, 30.1);
    }
    EXPECT_FALSE(next_session.find("/scans/b.pbvg", 6));
    EXPECT_FALSE(next_session.find("/scans/a.pbvg", 8));
}

TEST_F(SavedViewsTest, DamagedLinesAreSkipped) {
    const SavedViews views(file());
    ASSERT_TRUE(views.save("/a", 6, view(1)));
    std::ofstream(file(), std::ios::app) << "\n\t\n6\n6 \t/b\n6 --camera-position=1,2\t/c\n"
                                         << "6 --camera-position=1,2,3 --camera-focal-point=1,2,3 "
                                            "--camera-view-up=0,0,1 --camera-view-angle=30\t/d\n"
                                         << "6 nonsense\t/e\n6 --camera-position=nan,0,0\t/f\n";
    EXPECT_TRUE(views.find("/a", 6));
    for (const char *const path : {"/b", "/c", "/d", "/e", "/f"})
        EXPECT_FALSE(views.find(path, 6)) << path; // /d: a camera at its focal point
    EXPECT_TRUE(views.save("/b", 6, view(2)));
    EXPECT_TRUE(views.find("/a", 6));
    EXPECT_TRUE(views.find("/b", 6));
}

TEST_F(SavedViewsTest, TheOldestAreForgotten) {
    const SavedViews views(file());
    for (std::size_t i = 0; i <= SavedViews::kMax; ++i)
        ASSERT_TRUE(views.save("/" + std::to_string(i), 6, view(static_cast<double>(i))));
    EXPECT_FALSE(views.find("/0", 6));
    EXPECT_TRUE(views.find("/1", 6));
    EXPECT_TRUE(views.find("/" + std::to_string(SavedViews::kMax), 6));
}

TEST_F(SavedViewsTest, SayWhatCannotBeKept) {
    EXPECT_FALSE(SavedViews("").save("/a", 6, view(1)));
    EXPECT_FALSE(SavedViews("").find("/a", 6));
    EXPECT_FALSE(SavedViews(file()).save("/a\nb", 6, view(1)));
    const auto refused = SavedViews("/proc/none/views").save("/a", 6, view(1));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::io);
}

} // namespace
} // namespace pbm
