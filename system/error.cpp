#include "system/error.h"

#include <array>
#include <charconv>

namespace pbm {

std::string_view to_string(ErrorCode code) {
    switch (code) {
    case ErrorCode::usage: return "usage";
    case ErrorCode::io: return "io";
    case ErrorCode::not_bvg: return "not_bvg";
    case ErrorCode::truncated: return "truncated";
    case ErrorCode::bad_hash: return "bad_hash";
    case ErrorCode::bad_header: return "bad_header";
    case ErrorCode::bad_table: return "bad_table";
    case ErrorCode::bad_section: return "bad_section";
    case ErrorCode::bad_directory: return "bad_directory";
    case ErrorCode::bad_octree: return "bad_octree";
    case ErrorCode::bad_attribute: return "bad_attribute";
    case ErrorCode::bad_image: return "bad_image";
    case ErrorCode::bad_content: return "bad_content";
    case ErrorCode::bad_input: return "bad_input";
    case ErrorCode::too_large: return "too_large";
    case ErrorCode::memory: return "memory";
    case ErrorCode::unsupported_version: return "unsupported_version";
    case ErrorCode::unsupported_feature: return "unsupported_feature";
    }
    return "unknown";
}

namespace {

std::string to_string(Value::Hash hash) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text = "0x";
    for (int shift = 60; shift >= 0; shift -= 4)
        text += kDigits[hash.value >> shift & 15];
    return text;
}

} // namespace

std::string to_string(const Value &value) {
    if (const auto *text = std::get_if<std::string>(&value.held()))
        return *text;
    std::array<char, 32> digits{};
    const auto print = [&](auto number) {
        return std::string(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
    };
    if (const auto *number = std::get_if<std::uint64_t>(&value.held()))
        return print(*number);
    if (const auto *number = std::get_if<std::int64_t>(&value.held()))
        return print(*number);
    if (const auto *number = std::get_if<double>(&value.held()))
        return print(*number);
    if (const auto *hash = std::get_if<Value::Hash>(&value.held()))
        return to_string(*hash);
    return {};
}

bool has_offset(const Error &error) { return is_damage(error.code) || error.offset != 0; }

int exit_code(ErrorCode code) {
    switch (code) {
    case ErrorCode::usage: return 1;
    case ErrorCode::io: return 2;
    case ErrorCode::memory: return 4;
    case ErrorCode::unsupported_version:
    case ErrorCode::unsupported_feature: return 5;
    default: return 3;
    }
}

Error out_of_memory() { return {ErrorCode::memory, 0, "out of memory"}; } // fits the string's own buffer

} // namespace pbm
