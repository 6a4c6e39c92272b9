// Batches: how much memory there is, how much their builds are taken to need, and how many run at a time.
#include "pbm_batch/build_batch.h"
#include "pbm_batch/memory_estimate.h"
#include "system/processes/usable_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

namespace pbm::batch {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMega = std::uint64_t{1} << 20;

TEST(MemoryEstimate, LearnsFromThreeScansOfAKind) {
    MemoryEstimate estimate;
    const std::uint64_t guess = estimate.of("a.ply", 100 * kMega);
    EXPECT_GT(guess, 400 * kMega); // what such a build needs
    EXPECT_GT(estimate.of("a.laz", 100 * kMega), guess);
    EXPECT_GT(estimate.of("a.ply.gz", 100 * kMega), guess);
    for (const std::uint64_t peak : {std::uint64_t{296}, std::uint64_t{396}, std::uint64_t{196}}) {
        EXPECT_EQ(estimate.of("b.ply", 100 * kMega), guess);
        estimate.learn("b.PLY", 100 * kMega, peak * kMega);
    }
    EXPECT_NEAR(static_cast<double>(estimate.of("c.ply", 200 * kMega)), (96 + 1.1 * 600) * kMega, 1);
    EXPECT_GT(estimate.of("c.ply.gz", 100 * kMega), guess); // another kind
    estimate.learn("c.ply", 0, 900 * kMega);                // nothing is known of a scan that is not there
    EXPECT_LT(estimate.of("c.ply", 200 * kMega), 800 * kMega);
}

TEST(UsableMemory, IsThatOfTheLowestControlGroup) {
    const fs::path mounted = fs::path(::testing::TempDir()) / "control_groups";
    const auto limit = [&](const char *file, const char *text) {
        fs::create_directories((mounted / file).parent_path());
        std::ofstream(mounted / file) << text << '\n';
    };
    constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();
    const auto memory = [&](const char *groups) { return control_group_memory(groups, mounted.string()); };
    EXPECT_EQ(memory(""), kNone);
    EXPECT_EQ(memory("0::/job/task\n"), kNone);
    limit("job/memory.max", "5000");
    limit("job/task/memory.max", "max");
    EXPECT_EQ(memory("0::/job/task\n"), 5000U); // of the group above
    EXPECT_EQ(memory("0::/\n"), kNone);
    limit("job/task/memory.max", "4000");
    EXPECT_EQ(memory("0::/job/task\n"), 4000U);
    limit("memory/memory.limit_in_bytes", "3000"); // a container, which does not see the path of the host
    EXPECT_EQ(memory("12:cpu,cpuacct:/docker/abc\n4:hugetlb,memory:/docker/abc\n0::/job/task\n"), 3000U);
    EXPECT_EQ(memory("4:freezer:/\n"), kNone);
    EXPECT_GT(usable_memory(), std::uint64_t{1} << 20);
    fs::remove_all(mounted);
}

// Builds by a script that notes how many run at the same time.
class Batches : public ::testing::Test {
  protected:
    Batches() {
        fs::remove_all(folder_);
        fs::create_directories(folder_ / "running");
        std::ofstream(folder_ / "build") << "cd '" << folder_.string() << R"('
for last in "$@"; do :; done
mkdir "running/$$"; ls running | wc -l >>counts; sleep 0.1; rmdir "running/$$"
echo '7 read'; echo '{"peak_memory":1048576,'; echo ' "points":3}'
case "$last" in *bad*) echo 'pbm-build: it is bad' >&2; exit 3;; *killed*) kill -9 $$;; esac
)";
    }
    ~Batches() override { fs::remove_all(folder_); }

    std::vector<Ending> build(const std::vector<std::string> &names, Request request) {
        scans_.clear();
        for (const std::string &name : names)
            scans_.push_back({.name = name, .input = name, .output = (folder_ / "out" / name).string(), .bytes = 1000});
        request.builder = {"sh", (folder_ / "build").string()};
        std::vector<Ending> endings;
        build_all(scans_, request, [&](const Ending &ending) { endings.push_back(ending); });
        return endings;
    }
    int most_at_a_time() const {
        std::ifstream counts(folder_ / "counts");
        int most = 0;
        for (int count = 0; counts >> count;)
            most = std::max(most, count);
        return most;
    }

  private:
    const fs::path folder_ =
        fs::temp_directory_path() /
        ("pbm_batch_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::vector<Scan> scans_;
};

TEST_F(Batches, RunAsManyBuildsAsJobsAllow) {
    const std::vector<Ending> endings = build({"a", "b", "c", "d", "e", "f"}, {.builder = {}, .jobs = 2});
    ASSERT_EQ(endings.size(), 6U);
    EXPECT_LE(most_at_a_time(), 2);
    for (const Ending &ending : endings) {
        EXPECT_EQ(ending.exit_code, 0) << ending.message;
        EXPECT_EQ(ending.document, "{\"peak_memory\":1048576,\n \"points\":3}\n");
    }
}

TEST_F(Batches, RunAsManyBuildsAsMemoryAllowsButOneAlways) {
    EXPECT_EQ(build({"a", "b", "c"}, {.builder = {}, .jobs = 3, .max_memory = 150 * kMega}).size(), 3U);
    EXPECT_EQ(most_at_a_time(), 1);
}

TEST_F(Batches, StopAfterAFailureUnlessToldToGoOn) {
    std::vector<Ending> endings = build({"a", "bad", "c", "killed", "d"}, {.builder = {}, .jobs = 1});
    ASSERT_EQ(endings.size(), 2U);
    EXPECT_EQ(endings[1].exit_code, 3);
    EXPECT_EQ(endings[1].message, "pbm-build: it is bad");
    endings = build({"a", "bad", "c", "killed", "d"}, {.builder = {}, .jobs = 1, .keep_going = true});
    ASSERT_EQ(endings.size(), 5U);
    EXPECT_EQ(endings[3].exit_code, 4);
    EXPECT_NE(endings[3].message.find("signal"), std::string::npos);
    EXPECT_EQ(endings[4].exit_code, 0);
}

} // namespace
} // namespace pbm::batch
