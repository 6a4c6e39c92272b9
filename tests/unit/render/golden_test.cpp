// Pictures of the golden files: every later version draws the same. format_spec/golden/README.md
#include "unit/render/golden_pictures.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <set>

namespace pbm::golden {
namespace {

constexpr int kMaxOff = 16; // of 255, for the mean of a cell

void expect_picture(const Framebuffer &picture, const Json &expected, const std::string &story) {
    const Bytes cells = coarse(picture);
    const std::string &kept = expected.at("cells").get_ref<const std::string &>();
    ASSERT_EQ(kept.size(), 2 * cells.size()) << story;
    int most = 0;
    for (std::size_t i = 0; i < cells.size(); ++i)
        most = std::max(most, std::abs(std::stoi(kept.substr(2 * i, 2), nullptr, 16) - int{cells[i]}));
    EXPECT_LE(most, kMaxOff) << story << ": another picture than when the version was frozen";
    EXPECT_EQ(hash_of(picture), expected.at("hash").get<std::string>())
        << story << ": if drawing was to change, write the hashes anew (format_spec/golden/README.md)";
}

void expect_pictures(const std::filesystem::path &file, const Json &expected) {
    const MappedFile bytes = value_of(MappedFile::open(file.string()));
    const Scene scene(bytes.bytes(), camera_of(expected.at("camera")));
    expect_picture(scene.reference(model_of(bytes.bytes())), expected.at("reference"), file.string() + ", reference");
    const Framebuffer fast = scene.fast(), fine = scene.fine();
    expect_picture(fast, expected.at("fast"), file.string() + ", fast");
    expect_picture(fine, expected.at("fine"), file.string() + ", fine");
    EXPECT_EQ(scene.fast(8).colour, fast.colour) << file << ", 8 threads";
    EXPECT_EQ(scene.fine(8).colour, fine.colour) << file << ", 8 threads";
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        EXPECT_EQ(scene.fast().colour, fast.colour) << file << ", " << hwy::TargetName(target);
        EXPECT_EQ(scene.fine().colour, fine.colour) << file << ", " << hwy::TargetName(target);
        hwy::SetSupportedTargetsForTest(0);
    }
}

TEST(Golden, EveryFileOfEveryFrozenVersionIsDrawnAsItWas) {
    ASSERT_FALSE(versions().empty());
    for (const auto &folder : versions()) {
        std::set<std::string> drawn;
        const Json pictures = read_json(folder / "pictures.json");
        for (const Json &expected : pictures.at("files")) {
            drawn.insert(expected.at("file").get<std::string>());
            expect_pictures(folder / expected.at("file").get<std::string>(), expected);
        }
        for (const auto &file : std::filesystem::directory_iterator(folder))
            EXPECT_TRUE(file.path().extension() != ".pbvg" || drawn.contains(file.path().filename().string()))
                << file.path() << " is not in pictures.json";
    }
}

} // namespace
} // namespace pbm::golden
