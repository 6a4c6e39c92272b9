// Declares command lines, and leads from argv to an exit code. CLI11 parses; since it takes seconds to compile,
// parse.cpp alone includes it.
#pragma once

#include "command_line/command_line.h"
#include "command_line/error_log.h"
#include "command_line/help.h"
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

// Prints it and ends the program.
struct Version {
    std::string text;
};

// The option takes the name of a file of settings. Every long option is a key in it; the command line wins over it.
// Unknown keys and values of a wrong type are refused, and the error names the line.
struct SettingsFile {
    ReadSettings read;
};

// What an option does with its value: it goes into a variable (a bool makes the option a flag) or to a function (one
// without a parameter makes it a flag; an error that it returns is a usage error).
using Target = std::variant<bool *, int *, unsigned *, std::uint64_t *, double *, std::string *, std::optional<int> *,
                            std::optional<std::uint64_t> *, std::optional<double> *, std::vector<std::string> *,
                            std::function<void()>, std::function<void(int)>, std::function<Status(const std::string &)>,
                            Version, SettingsFile>;

// What a value may be: within limits, which are inclusive; one of some words; what a function says nothing against.
struct Integers {
    std::int64_t least, most;
};
struct Numbers {
    double least, most;
};
using Words = std::vector<std::string>;
using Check =
    std::variant<std::monostate, Integers, Numbers, Words, std::function<std::string(const std::string &value)>>;

// What else holds of an option.
struct OptionRules {
    std::string type{}; // "FILE", "R,G,B"; default: by the target and the check
    Check check{};
    bool required = false;
    bool shows_default = false;          // help tells the value that the target has before
    std::string alone{};                 // the value of a std::string that is given as a flag
    char separator = 0;                  // between several values in one word
    std::vector<std::string> excludes{}; // names of options that were added before
    std::string needs{};                 // name of an option that was added before
    std::string topic{};                 // page of help; default: that of the command line
};

struct Option {
    std::string names; // "-o,--output"; "FILE": an argument that needs no name; "!--no-ground": sets its flag to false
    std::string help;
    Target target;
    OptionRules rules{};
};

// A value on the command line or in a file of settings. It names a file if its type says FILE, if it is the output, or
// if it needs no option's name, except for the words of a type like FILE|default.
struct GivenValue {
    std::string name; // "--output"; "FILE" if the option needs no name
    std::string topic;
    std::string type; // "N" for numbers, "565|888" for words, "TEXT", "FILE"
    std::string value;
    bool is_file = false;
};

struct CommandLine {
    std::string program;
    std::string description;       // a sentence; then paragraphs, each after a line feed
    std::string topic = "Options"; // of the options that are added next
    std::vector<Option> options{};
    std::vector<GivenValue> given{}; // by parse(), in the order of `options`

    void add(std::string names, std::string help, Target target, OptionRules rules = {});
    void add_version(const std::string &version); // -V, --version
};

// What help says beyond the options themselves.
struct Manual {
    std::vector<std::string> most_used{}; // long names on the first page; empty: the options with a short name
    std::vector<Example> examples{};
    std::string run_time_limits{}; // what ends with exit code 4 beside memory
    bool logs_steps = false;       // with -v and --log
};

// Parses; returns the exit code of a program that has said all it had to say (help, version, a usage error), or
// nothing when it may go on. Adds what all programs have: --help TOPIC and --log FILE.
std::optional<int> parse(CommandLine &line, int argc, char **argv, std::span<const OldSwitch> switches = {},
                         const Manual &manual = {});

// A target that stores what `read` makes of a text, and a check that `read` understands it. `read` takes a
// const std::string & and returns a Result.
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
