// One option as a file of settings says it.
#pragma once

#include "system/error.h"

#include <functional>
#include <string>
#include <vector>

namespace pbm::command_line {

struct Setting {
    enum class Kind { text, number, flag };
    std::string key; // an option's long name without its dashes, or in lower case the name of what needs none (INPUT)
    Kind kind = Kind::text;          // of every value
    std::vector<std::string> values; // as they would stand on the command line; flags as true or false
    bool is_array = false;
    std::size_t line = 0;
};

// errors  io     the file cannot be read
//         usage  it cannot be understood
using ReadSettings = std::function<Result<std::vector<Setting>>(const std::string &path)>;

} // namespace pbm::command_line
