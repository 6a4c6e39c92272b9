// Values of untrusted JSON: what is missing or of another type is absent, except indices.
#pragma once

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

namespace pbm::build {

using Json = nlohmann::json;

// Null if `from` is null, no object, or has no such member.
inline const Json *member(const Json *from, const char *key) {
    if (from == nullptr || !from->is_object())
        return nullptr;
    const auto found = from->find(key);
    return found == from->end() ? nullptr : &*found;
}

// Null if `from` is null, no array, or too short.
inline const Json *item(const Json *from, std::size_t index) {
    return from != nullptr && from->is_array() && index < from->size() ? &(*from)[index] : nullptr;
}

inline std::size_t items(const Json *from) { return from != nullptr && from->is_array() ? from->size() : 0; }

// An index or a count. A value that is none becomes the largest one, which no array has: what is there but damaged must
// not count as absent.
inline std::optional<std::size_t> index_of(const Json *value) {
    if (value == nullptr)
        return std::nullopt;
    if (value->is_number_unsigned())
        return value->get<std::size_t>();
    constexpr double kMax = 9007199254740992; // 2^53: "3.0" is an integer too
    const double number = value->is_number_float() ? value->get<double>() : -1;
    return number >= 0 && number <= kMax && number == std::floor(number) ? static_cast<std::size_t>(number)
                                                                         : ~std::size_t{0};
}
inline std::optional<std::size_t> index_of(const Json *from, const char *key) { return index_of(member(from, key)); }

// Finite; `otherwise` where absent.
inline double number_of(const Json *value, double otherwise) {
    if (value == nullptr || !value->is_number())
        return otherwise;
    const auto number = value->get<double>();
    return std::isfinite(number) ? number : otherwise;
}
inline double number_of(const Json *from, const char *key, double otherwise) {
    return number_of(member(from, key), otherwise);
}

inline bool is_true(const Json *value) { return value != nullptr && value->is_boolean() && value->get<bool>(); }

inline std::string text_of(const Json *value) {
    return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}
inline std::string text_of(const Json *from, const char *key) { return text_of(member(from, key)); }

} // namespace pbm::build
