// Declares command lines and parses them with CLI11. Only parse.cpp includes CLI11, which takes seconds to compile.
#pragma once

#include "command_line/command_line.h"
#include "command_line/error_log.h"
#include "command_line/help/help.h"
#include "command_line/setting.h"
#include "command_line/spelling.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace pbm::command_line {

// An option that prints the version and ends the program.
struct Version {
    std::string text;
};

// An option that names a file of settings. Every long option is a key in it; the command line takes precedence. Unknown
// keys and values of a wrong type are errors that name the line. Outputs that it names must lie in its folder or below
// (is_below), unless the command line has the flag --allow-outside, which the program declares.
struct SettingsFile {
    ReadSettings read;
};

// Whether `file`, existing or not, lies in the folder of `settings` or below it, after symbolic links.
bool is_below(const std::string &file, const std::string &settings);

// Target of an option's value: a variable (bool: the option is a flag) or a function (without parameter: the option is
// a flag; functions are called in the order of declaration; an error that it returns is a usage error).
using Target = std::variant<bool *, int *, unsigned *, std::uint64_t *, double *, std::string *, std::optional<int> *,
                            std::optional<std::uint64_t> *, std::optional<double> *, std::vector<std::string> *,
                            std::function<void()>, std::function<void(int)>, std::function<Status(const std::string &)>,
                            Version, SettingsFile>;

// Condition on a value: inclusive limits, one of some words, or a function that returns no complaint.
struct Integers {
    std::int64_t least, most;
};
struct Numbers {
    double least, most;
};
using Words = std::vector<std::string>;
using Check =
    std::variant<std::monostate, Integers, Numbers, Words, std::function<std::string(const std::string &value)>>;

// Further properties of an option.
struct OptionRules {
    std::string type{}; // "FILE", "R,G,B"; default: from target and check
    Check check{};
    bool required = false;
    bool shows_default = false;          // help shows the target's initial value
    std::string alone{};                 // value of a std::string if the option is given without one
    char separator = 0;                  // separates several values in one word
    bool is_setting = true;              // it may stand in a file of settings
    std::vector<std::string> excludes{}; // names of options added before
    std::string needs{};                 // name of an option added before
    std::string topic{};                 // help page; default: that of the command line
    std::function<Words()> proposals{};  // values that shells complete, if `type` does not name them
};

struct Option {
    std::string names; // "-o,--output"; "FILE": positional; "!--no-ground": sets its flag to false
    std::string help;
    Target target;
    OptionRules rules{};
};

// A value from the command line or a file of settings. It names a file if its type says FILE, if it is the output, or
// if it is positional, except for the words of a type like FILE|default.
struct GivenValue {
    std::string name; // "--output"; "FILE" if positional
    std::string topic;
    std::string type; // "N" for numbers, "565|888" for words, "TEXT", "FILE"
    std::string value;
    bool is_file = false;
    bool is_setting = false; // from the file of settings
};

struct CommandLine {
    std::string program;
    std::string description;       // one sentence; then paragraphs, each after a line feed
    std::string topic = "Options"; // of options added next
    std::vector<Option> options{};
    std::vector<GivenValue> given{}; // filled by parse(), in the order of `options`

    void add(std::string names, std::string help, Target target, OptionRules rules = {});
    void add_version(const std::string &version); // -V, --version
};

// Parses. Returns the exit code if the program is done (help, version, a usage error), else nothing. Adds the options
// of all programs: --help TOPIC (help/help.h; "bash", "zsh" and "fish" print the scripts of help/completion.h) and
// --log FILE. --json, if declared, also takes the JSON of a failure.
std::optional<int> parse(CommandLine &line, int argc, char **argv, std::span<const OldSwitch> switches = {},
                         const Manual &manual = {});

// For libraries, which have no command line: an option by its long name without dashes. The functions below print
// nothing, and know neither --help nor --log.
struct NamedValue {
    std::string name;                 // "depth"
    std::optional<std::string> value; // absent or "true" for flags; "false" leaves a flag out
};
// The words that give these options, "--depth=9".
//
// errors  usage  an option that `line` has not, or a flag with another value
Result<std::vector<std::string>> words_of(const CommandLine &line, std::span<const NamedValue> options);
// Parses words without the program's name.
//
// errors  usage, and those of a file of settings; the message names the file
Status parse_words(CommandLine &line, std::vector<std::string> words);

// A target that stores read(text), a const std::string & to a Result, and a check that read(text) succeeds.
template <class Read, class T> std::function<Status(const std::string &)> stored(Read read, T &target) {
    return [read, &target](const std::string &text) -> Status {
        auto value = read(text);
        if (!value)
            return value.error();
        target = std::move(value).value();
        return {};
    };
}
template <class Read> std::function<std::string(const std::string &)> readable(Read read) {
    return [read](const std::string &text) {
        const auto value = read(text);
        return value ? std::string() : value.error().message;
    };
}

} // namespace pbm::command_line
