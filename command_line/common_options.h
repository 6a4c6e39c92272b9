// Options that several programs have: the same names, the same words. Included where command lines are declared only.
#pragma once

#include "command_line/parse.h"
#include "command_line/progress_display.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace pbm::command_line {

// `threads`: 0 for one per processor.
template <class Count> void add_threads(CLI::App &app, Count &threads) {
    app.add_option("-j,--threads", threads, "Threads; default 0: as many as processors")
        ->check(CLI::Range(Count{0}, Count{1024}));
}

// One of several words, each with what it stands for. `what` is what a wrong word is not: "camera mode".
template <class Value>
CLI::Option *add_choice(CLI::App &app, const std::string &name, const std::string &what,
                        std::vector<std::pair<std::string, Value>> choices, Value &target, const std::string &help) {
    std::string words, list; // "a|b|c", "a, b or c"
    for (std::size_t i = 0; i < choices.size(); ++i) {
        words += (i == 0 ? "" : "|") + choices[i].first;
        list += (i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ") + choices[i].first;
    }
    const auto find = [choices = std::move(choices)](const std::string &word) {
        const auto found = std::find_if(choices.begin(), choices.end(), [&](const auto &c) { return c.first == word; });
        return found == choices.end() ? std::nullopt : std::optional<Value>(found->second);
    };
    return app
        .add_option_function<std::string>(
            name, [find, &target](const std::string &word) { target = *find(word); }, help)
        ->type_name(words)
        ->check([=](const std::string &word) {
            return find(word) ? std::string() : "'" + word + "' is no " + what + "; write " + list;
        });
}

inline void add_max_memory(CLI::App &app, std::uint64_t &bytes) {
    app.add_option_function<std::string>(
           "--max-memory", [&bytes](const std::string &text) { bytes = *parse_bytes(text); },
           "Refuse what needs more, like 500M; default 8G")
        ->type_name("BYTES")
        ->check([](const std::string &text) {
            const auto amount = parse_bytes(text);
            return amount ? std::string() : amount.error().message;
        });
}

// `path`: a file, "-" for standard output, empty for none.
inline void add_json(CLI::App &app, std::string &path, const std::string &what) {
    app.add_option("--json", path, what + " as JSON, to FILE or (--json alone) to stdout")->type_name("[=FILE]");
}

inline void add_quiet(CLI::App &app, Verbosity &verbosity) {
    app.add_flag_callback(
        "-q,--quiet", [&verbosity] { verbosity = Verbosity::quiet; }, "Say nothing but errors");
}

inline void add_verbose(CLI::App &app, Verbosity &verbosity, const std::string &what) {
    app.add_flag_callback(
        "-v,--verbose", [&verbosity] { verbosity = Verbosity::verbose; }, what);
}

} // namespace pbm::command_line
