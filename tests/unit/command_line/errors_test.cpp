// Errors as text: always one line, for any file name; with the offset, if known, and the name of the file.
#include "command_line/command_line.h"
#include "command_line/error_log.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <sstream>

namespace pbm::command_line {
namespace {

std::string said_by(const std::function<int()> &run, int expected_code) {
    testing::internal::CaptureStderr();
    const int code = run();
    std::string said = testing::internal::GetCapturedStderr();
    EXPECT_EQ(code, expected_code) << said;
    return said;
}

TEST(Errors, ControlCharactersInNamesKeepALineOneLine) {
    EXPECT_EQ(printable("a\nb\tc\x1b[31m\x7f"), "a\\nb\\tc\\x1b[31m\\x7f");
    EXPECT_EQ(printable("\xC2\x9B"), "\\xc2\\x9b"); // CSI in UTF-8
    EXPECT_EQ(printable("gr\xC3\xBC\xC3\x9F"), "gr\xC3\xBC\xC3\x9F");
    EXPECT_EQ(said_by([] { return fail("pbm-x", "a\nb", {ErrorCode::io, 0, "gone"}); }, 2), "pbm-x: a\\nb: gone\n");
}

TEST(Errors, DamageInTheFirstByteHasAPlace) {
    EXPECT_EQ(said_by(
                  [] {
                      return fail("pbm-x", "f", {ErrorCode::bad_hash, 0, "2.3 changed"});
                  },
                  3),
              "pbm-x: f: 2.3 changed (offset 0)\n");
    EXPECT_EQ(said_by(
                  [] {
                      return fail("pbm-x", "f", {ErrorCode::bad_input, 0, "no points"});
                  },
                  3),
              "pbm-x: f: no points\n");
    EXPECT_EQ(said_by(
                  [] {
                      return fail("pbm-x", "f", {ErrorCode::bad_input, 7, "line 2"});
                  },
                  3),
              "pbm-x: f: line 2 (offset 7)\n");
}

TEST(Errors, MemoryThatIsNotThereNamesTheFileWorkedOn) {
    const auto without_memory = [] {
        return run_program("pbm-x", []() -> int {
            work_on("big.ply");
            throw std::bad_alloc();
        });
    };
    EXPECT_EQ(said_by(without_memory, 4),
              "pbm-x: big.ply: out of memory; end other programs or choose a coarser model\n");
    work_on("");
}

TEST(Errors, SwitchesOfTheDissertationAreRefusedOrMapped) {
    const auto given = [](std::vector<const char *> words, std::span<const OldSwitch> switches) {
        words.insert(words.begin(), "pbm-x");
        return arguments(static_cast<int>(words.size()), const_cast<char **>(words.data()), switches);
    };
    for (const char *name : {"-AVI", "-BACKGROUND", "-SHADOW", "-TEXTURE", "-ENVIRONMENT_MAP"}) {
        const auto refused = given({"a.pbvg", name}, {});
        ASSERT_FALSE(refused.ok()) << name;
        EXPECT_NE(refused.error().message.find(std::string(name) + " is a switch of pbm-"), std::string::npos);
        EXPECT_NE(refused.error().message.find("; leave it out here"), std::string::npos);
        EXPECT_EQ(exit_code(refused.error().code), 1);
    }
    const std::array<OldSwitch, 1> known{{{"-IGNORE_POINT_COLOURS", "--ignore-point-colours"}}};
    EXPECT_EQ(value_of(given({"-IGNORE_POINT_COLOURS"}, known)).front(), "--ignore-point-colours");
    EXPECT_EQ(exit_code(given({"-IGNORE_POINT_COLOURS"}, {}).error().code), 1);
    EXPECT_EQ(value_of(given({"--", "-SHADOW", "--json"}, {})),
              (std::vector<std::string>{"--json", "-SHADOW", "--"})); // after "--" come file names
}

TEST(Errors, StandardOutputTakesOneOutput) {
    const std::array<OutputFile, 3> outputs{{{"--output", "-"}, {"--log", ""}, {"--json", "-"}}};
    EXPECT_EQ(said_by([&] { return refuse_outputs("pbm-x", {}, outputs).value_or(0); }, 1),
              "pbm-x: standard output takes one output; name a file for the other; see pbm-x --help\n");
}

TEST(ErrorLog, KeepsEarlierLinesAndAddsOneEach) {
    const std::string path = testing::TempDir() + "error_log_test.log";
    std::ofstream(path) << "earlier\n";
    ASSERT_TRUE(open_log("pbm-x", path).ok());
    EXPECT_EQ(log_path(), path);
    log_line(LogKind::warning, "two\nlines");
    said_by([] { return fail("pbm-x", "f", {ErrorCode::io, 0, "gone"}); }, 2);
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    std::string line;
    std::getline(text, line);
    EXPECT_EQ(line, "earlier");
    const std::string stamp = "2000-00-00T00:00:00Z";
    for (const char *expected : {" pbm-x: warning: two\\nlines", " pbm-x: error: f: gone"}) {
        ASSERT_TRUE(std::getline(text, line));
        EXPECT_EQ(line.substr(stamp.size()), expected);
        EXPECT_EQ(line[10], 'T');
        EXPECT_EQ(line[19], 'Z');
    }
    EXPECT_FALSE(std::getline(text, line));
    const std::array<OutputFile, 1> outputs{{{"--output", path}}};
    EXPECT_NE(said_by([&] { return refuse_outputs("pbm-x", {}, outputs).value_or(0); }, 1).find("is the log"),
              std::string::npos);
}

} // namespace
} // namespace pbm::command_line
