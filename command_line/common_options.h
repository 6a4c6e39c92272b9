// Options that several programs share.
#pragma once

#include "command_line/parse.h"
#include "command_line/progress_display.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace pbm::command_line {

// 0 asks for one thread per processor.
inline void add_threads(CommandLine &line, int &threads) {
    line.add("-j,--threads", "Threads; default 0: as many as processors", &threads, {.check = Integers{0, 1024}});
}

// An option with one of several words, each with its value. `what` names the kind of word in errors: "camera mode".
template <class Value>
void add_choice(CommandLine &line, const std::string &name, const std::string &what,
                std::vector<std::pair<std::string, Value>> choices, Value &target, const std::string &help) {
    std::string words, list; // "a|b|c", "a, b or c"
    for (std::size_t i = 0; i < choices.size(); ++i) {
        words += (i == 0 ? "" : "|") + choices[i].first;
        list += (i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ") + choices[i].first;
    }
    const auto find = [choices = std::move(choices), what, list](const std::string &word) -> Result<Value> {
        const auto found = std::find_if(choices.begin(), choices.end(), [&](const auto &c) { return c.first == word; });
        if (found == choices.end())
            return usage_error("'" + word + "' is no " + what + "; write " + list);
        return found->second;
    };
    line.add(name, help, stored(find, target), {.type = words, .check = readable(find)});
}

inline void add_max_memory(CommandLine &line, std::uint64_t &bytes) {
    line.add("--max-memory", "Refuse what needs more, like 500M; default 8G", stored(parse_bytes, bytes),
             {.type = "BYTES", .check = readable(parse_bytes)});
}

// `path`: a file, "-" for standard output, empty for none.
inline void add_json(CommandLine &line, std::string &path, const std::string &what) {
    line.add("--json", what + " as JSON, to FILE or (--json alone) to stdout", &path, {.type = "[=FILE]"});
}

inline void add_quiet(CommandLine &line, Verbosity &verbosity) {
    line.add("-q,--quiet", "Say nothing but errors", [&verbosity] { verbosity = Verbosity::quiet; });
}

inline void add_verbose(CommandLine &line, Verbosity &verbosity, const std::string &what) {
    line.add("-v,--verbose", what, [&verbosity] { verbosity = Verbosity::verbose; });
}

} // namespace pbm::command_line
