// Options with several fields: "spot,from=-1,2,1.5,intensity=0.8".
#pragma once

#include "pbm_format/model/point_values.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/words.h"

#include <glm/vec3.hpp>

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

using Vector = glm::dvec3;

// A word, then key=value between commas; commas within a value separate its numbers.
struct OptionFields {
    struct Field {
        std::string key, value;
    };
    std::string word; // empty: the text starts with a key
    std::vector<Field> fields;
};

// errors  usage  an empty part, a key twice, a word behind the first place; the message quotes it
Result<OptionFields> split_fields(std::string_view text);

// errors  usage  not that many finite numbers between commas
Result<double> read_number(std::string_view text);
Result<Vector> read_vector(std::string_view text);

// errors  usage  neither #rrggbb nor three whole numbers 0..255
Result<Rgb8> read_colour(std::string_view text);

// Moves the value to `to`, or returns the error.
template <class T> Status take(Result<T> value, T &to) {
    if (!value)
        return value.error();
    to = std::move(*value);
    return {};
}

// "; NAME, NAME or NAME": what to write instead of a word that is not among `known`.
inline std::string suggestion(std::span<const std::string_view> known) { return "; " + joined(known, " or "); }

} // namespace pbm::build
