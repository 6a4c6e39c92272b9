#include "pbm_build/scene/option_fields.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace pbm::build {
namespace {

Error usage(std::string message) { return {ErrorCode::usage, 0, std::move(message)}; }

// Parts between commas; an empty text has one empty part.
std::vector<std::string_view> split(std::string_view text) {
    std::vector<std::string_view> parts;
    for (std::size_t begin = 0;;) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        parts.push_back(text.substr(begin, end - begin));
        if (end == text.size())
            return parts;
        begin = end + 1;
    }
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && text.front() == ' ')
        text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ')
        text.remove_suffix(1);
    return text;
}

} // namespace

Result<OptionFields> split_fields(std::string_view text) {
    OptionFields result;
    for (const std::string_view whole : split(text)) {
        const std::string_view part = trimmed(whole);
        const std::size_t equals = part.find('=');
        if (part.empty() || equals == 0)
            return usage(in_quotes(text) + " has an empty part");
        if (equals == std::string_view::npos) {
            if (!result.fields.empty())
                (result.fields.back().value += ',') += part;
            else if (result.word.empty())
                result.word = part;
            else
                return usage(in_quotes(part) + " is no key=value");
            continue;
        }
        const std::string_view key = trimmed(part.substr(0, equals));
        if (std::any_of(result.fields.begin(), result.fields.end(),
                        [&](const auto &field) { return field.key == key; }))
            return usage(in_quotes(key) + " is given twice");
        result.fields.push_back({std::string(key), std::string(trimmed(part.substr(equals + 1)))});
    }
    return result;
}

Result<double> read_number(std::string_view text) {
    const char *const end = text.data() + text.size();
    double value = 0;
    const auto [stop, failure] = std::from_chars(text.data(), end, value);
    if (failure != std::errc() || stop != end || !std::isfinite(value))
        return usage(in_quotes(text) + " is not a finite number");
    return value;
}

Result<Vector> read_vector(std::string_view text) {
    const auto parts = split(text);
    if (parts.size() != 3)
        return usage(in_quotes(text) + " is not X,Y,Z");
    Vector vector{};
    for (std::size_t i = 0; i < 3; ++i) {
        const Result<double> number = read_number(trimmed(parts[i]));
        if (!number)
            return number.error();
        vector[i] = *number;
    }
    return vector;
}

Result<Rgb8> read_colour(std::string_view text) {
    const Error refused = usage(in_quotes(text) + " is no colour; write #rrggbb or R,G,B, each 0..255");
    Rgb8 colour{};
    const bool hex = text.size() == 7 && text.front() == '#';
    const auto parts = split(text);
    if (!hex && parts.size() != 3)
        return refused;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::string_view digits = hex ? text.substr(1 + 2 * i, 2) : trimmed(parts[i]);
        const char *const end = digits.data() + digits.size();
        const auto [stop, failure] = std::from_chars(digits.data(), end, colour[i], hex ? 16 : 10);
        if (failure != std::errc() || stop != end)
            return refused;
    }
    return colour;
}

std::string in_quotes(std::string_view text) {
    std::string result(1, '\'');
    (result += text) += '\'';
    return result;
}

std::string suggestion(std::span<const std::string_view> known) {
    std::string text = "; ";
    for (std::size_t i = 0; i < known.size(); ++i)
        (text += i == 0 ? "" : i + 1 == known.size() ? " or " : ", ") += known[i];
    return text;
}

} // namespace pbm::build
