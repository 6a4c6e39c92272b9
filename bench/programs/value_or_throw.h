// Error handling of the benchmarks: throws a message that names the file.
#pragma once

#include "system/error.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace pbm::bench {

template <class T> T value_or_throw(Result<T> result, const std::string &file) {
    if (!result)
        throw std::runtime_error(file + ": " + result.error().message);
    return std::move(*result);
}

} // namespace pbm::bench
