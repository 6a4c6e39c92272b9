// Work on the rows of a picture that are finished while others are still drawn.
#pragma once

#include <cstddef>
#include <functional>

namespace pbm {

struct RowTasks {
    std::size_t count = 0;
    // The task needs all rows of the picture before this one. Ascending.
    std::function<int(std::size_t task)> end_row = {};
    // Called once per task, in any order, by thread number `thread` of the renderer's threads.
    std::function<void(std::size_t task, std::size_t thread)> run = {};
};

} // namespace pbm
