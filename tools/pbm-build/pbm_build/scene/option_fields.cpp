#include "pbm_build/scene/option_fields.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_number.h"

#include <algorithm>
#include <cmath>

namespace pbm::build {
Result<OptionFields> split_fields(std::string_view text) {
    OptionFields result;
    for (const std::string_view whole : split(text)) {
        const std::string_view part = trimmed(whole);
        const std::size_t equals = part.find('=');
        if (part.empty() || equals == 0)
            return usage_error(in_quotes(text) + " has an empty part");
        if (equals == std::string_view::npos) {
            if (!result.fields.empty())
                (result.fields.back().value += ',') += part;
            else if (result.word.empty())
                result.word = part;
            else
                return usage_error(in_quotes(part) + " is no key=value; for one more, repeat the option");
            continue;
        }
        const std::string_view key = trimmed(part.substr(0, equals));
        if (std::any_of(result.fields.begin(), result.fields.end(),
                        [&](const auto &field) { return field.key == key; }))
            return usage_error(in_quotes(key) + " is given twice");
        result.fields.push_back({std::string(key), std::string(trimmed(part.substr(equals + 1)))});
    }
    return result;
}

Result<double> read_number(std::string_view text) {
    const auto value = parse_all<double>(text);
    if (!value || !std::isfinite(*value))
        return usage_error(in_quotes(text) + " is not a finite number");
    return *value;
}

Result<Vector> read_vector(std::string_view text) {
    const auto parts = split(text);
    if (parts.size() != 3)
        return usage_error(in_quotes(text) + " is not X,Y,Z");
    Vector vector{};
    for (int axis = 0; axis < 3; ++axis) {
        const Result<double> number = read_number(trimmed(parts[static_cast<std::size_t>(axis)]));
        if (!number)
            return number.error();
        vector[axis] = *number;
    }
    return vector;
}

Result<Rgb8> read_colour(std::string_view text) {
    const Error refused = usage_error(in_quotes(text) + " is no colour; write #rrggbb or R,G,B, each 0..255");
    Rgb8 colour{};
    const bool hex = text.size() == 7 && text.front() == '#';
    const auto parts = split(text);
    if (!hex && parts.size() != 3)
        return refused;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::string_view digits = hex ? text.substr(1 + 2 * i, 2) : trimmed(parts[i]);
        const auto channel = parse_all<std::uint8_t>(digits, hex ? 16 : 10);
        if (!channel)
            return refused;
        colour[i] = *channel;
    }
    return colour;
}

} // namespace pbm::build
