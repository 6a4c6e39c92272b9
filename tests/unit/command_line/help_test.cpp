// Help pages and suggestions.
#include "command_line/help/help.h"
#include "command_line/spelling.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>

namespace pbm::command_line {
namespace {

TEST(Spelling, SlipsFindTheWordThatWasMeant) {
    const std::vector<std::string> known{"depth", "voxel-size", "max-points", "output", "name", "up"};
    EXPECT_EQ(nearest_word("detph", known), "depth");  // letters swapped
    EXPECT_EQ(nearest_word("deph", known), "depth");   // letter missing
    EXPECT_EQ(nearest_word("deepth", known), "depth"); // letter added
    EXPECT_EQ(nearest_word("voxel_size", known), "voxel-size");
    EXPECT_EQ(nearest_word("vox", known), "voxel-size"); // prefix of the word
    EXPECT_EQ(nearest_word("u", known), "up");
    EXPECT_EQ(nearest_word("viewpoint", known), "");
    EXPECT_EQ(nearest_word("", known), "");
    EXPECT_EQ(nearest_word("x", known), ""); // no known word starts with this letter
}

OptionHelp option(const std::string &name, const std::string &topic, const std::string &text = "Text") {
    return {.names = {name}, .value = "N", .text = text, .topic = topic};
}

std::size_t lines(const std::string &page) {
    return static_cast<std::size_t>(std::count(page.begin(), page.end(), '\n'));
}

TEST(Help, ShortHelpIsPrintedAtOnce) {
    ProgramHelp help{.program = "pbm-x", .version = "1", .summary = "Does x.", .description = "", .options = {}};
    help.options.push_back(option("--one", "General"));
    help.options.push_back(option("--two", "Grid"));
    const std::string page = value_of(help_page(help, ""));
    EXPECT_EQ(page.find("Topics"), std::string::npos);
    EXPECT_LT(page.find("--two"), page.find("--one")); // General comes last
    EXPECT_EQ(page, value_of(help_page(help, "all")));
    for (int i = 0; i < 30; ++i)
        help.options.push_back(option("--more-" + std::to_string(i), i < 15 ? "Grid" : "Further things"));
    const std::string first = value_of(help_page(help, ""));
    EXPECT_LE(lines(first), kPageLines);
    EXPECT_NE(first.find("\n  further-things "), std::string::npos);
    EXPECT_EQ(help_topics(help), (std::vector<std::string>{"grid", "further-things", "general"}));
}

TEST(Help, LongTextIsBrokenAtSpacesWithinTheColumns) {
    std::string text;
    for (int i = 0; i < 60; ++i)
        text += "word" + std::to_string(i) + " ";
    const ProgramHelp help{.program = "pbm-x",
                           .version = "1",
                           .summary = text,
                           .description = "",
                           .options = {option("--a-very-long-name-of-an-option", "Grid", text)}};
    const std::string page = value_of(help_page(help, "all"));
    std::istringstream words(page);
    std::map<std::string, int> count;
    for (std::string word; words >> word;)
        ++count[word];
    for (int i = 0; i < 60; ++i)
        EXPECT_EQ(count["word" + std::to_string(i)], 2) << "in the summary and in the option's text, unbroken";
    std::istringstream lines_of_page(page);
    std::size_t longest = 0;
    for (std::string line; std::getline(lines_of_page, line);)
        longest = std::max(longest, line.size());
    EXPECT_LT(longest, kPageColumns);
    EXPECT_GE(longest, kPageColumns - std::string_view(" word59").size()) << "lines are filled";
}

TEST(Help, AWrongTopicIsRefusedWithTheNearestOrAll) {
    const ProgramHelp help{.program = "pbm-x",
                           .version = "1",
                           .summary = "X.",
                           .description = "",
                           .options = {option("--a", "Grid"), option("--b", "General")}};
    EXPECT_EQ(help_page(help, "gird").error().message, "there is no help on 'gird'; did you mean 'grid'?");
    EXPECT_EQ(help_page(help, "camera").error().message, "there is no help on 'camera'; topics are grid, general, all");
}

TEST(ManPage, TextCannotBecomeARequestOrAnEscape) {
    ProgramHelp help{.program = "pbm-x", .version = "1", .summary = "Does x.", .description = "", .options = {}};
    help.options.push_back(option("--a", "Grid", ".so /etc/passwd and \\n(.g"));
    const std::string page = man_page(help);
    EXPECT_NE(page.find("\n\\&.so /etc/passwd and \\en(.g\n"), std::string::npos) << page;
    EXPECT_NE(page.find("\\fB\\-\\-a\\fR \\fIN\\fR"), std::string::npos);
}

} // namespace
} // namespace pbm::command_line
