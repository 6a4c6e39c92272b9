// The value of a result that must have one.
#pragma once

#include "system/error.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace pbm {

// Throws where there is no value: GoogleTest prints the error and fails the test, and other programs end with it.
template <class T> void require_value(const Result<T> &result) {
    if (!result)
        throw std::runtime_error(std::string(to_string(result.error().code)) + " at byte " +
                                 std::to_string(result.error().offset) + ": " + result.error().message);
}
template <class T> T value_of(Result<T> &&result) {
    require_value(result);
    return std::move(*result);
}
template <class T> T &value_of(Result<T> &result) {
    require_value(result);
    return *result;
}
template <class T> const T &value_of(const Result<T> &result) {
    require_value(result);
    return *result;
}

} // namespace pbm
