// What an error means to the person who looks at the window.
#pragma once

#include "system/error.h"

#include <string>
#include <vector>

namespace pbm {

struct Explanation {
    std::string what;                   // one sentence: what is wrong with the file
    std::string advice;                 // one sentence: what to do
    std::vector<std::string> details{}; // the program's own message, byte offset and rule of BVG.md
};

// `error` is of opening or drawing a file, with or without advice for the command line.
Explanation explain(const Error &error);

} // namespace pbm
