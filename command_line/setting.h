// One option in a file of settings.
#pragma once

#include "system/error.h"

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace pbm::command_line {

struct Setting {
    enum class Kind { text, number, flag };
    std::string key;        // an option's long name without dashes, or the lower-case name of a positional (INPUT)
    Kind kind = Kind::text; // of every value
    std::vector<std::string> values; // as on the command line; flags as true or false
    bool is_array = false;
    std::size_t line = 0;
    // Of a table, which is one value: texts that errors about one of its keys contain, and the lines of these keys.
    std::vector<std::pair<std::string, std::size_t>> lines_of_keys{};
};

// errors  io     the file cannot be read
//         usage  the file cannot be parsed
using ReadSettings = std::function<Result<std::vector<Setting>>(const std::string &path)>;

} // namespace pbm::command_line
