// Errors about inputs: files and options.
#pragma once

#include "system/error.h"

namespace pbm::build {

// `offset`: byte of the file; 0: none.
inline Error bad_input(std::string message, std::uint64_t offset = 0) {
    return {ErrorCode::bad_input, offset, std::move(message)};
}
inline Error too_large(std::string message, std::uint64_t offset = 0) {
    return {ErrorCode::too_large, offset, std::move(message)};
}
inline Error unsupported(std::string message) { return {ErrorCode::unsupported_feature, 0, std::move(message)}; }
inline Error out_of_memory(std::string message) { return {ErrorCode::memory, 0, std::move(message)}; }

} // namespace pbm::build
