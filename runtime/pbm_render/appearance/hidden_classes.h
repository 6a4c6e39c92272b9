// Which points of a classified model a picture leaves out.
// Stability: experimental.
#pragma once

#include "pbm_format/model/model.h"
#include "system/error.h"

#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

namespace pbm {

// The classes to draw: all but `dropped`, and if there are `shown` ones, of these alone.
struct ClassChoice {
    std::bitset<256> dropped{};
    std::optional<std::bitset<256>> shown{};
    bool draws_all() const { return dropped.none() && !shown; }
    bool operator==(const ClassChoice &) const = default;
};

// The points that are not drawn, by their values of a field. Coarser levels have the class of most of their points.
struct HiddenClasses {
    std::size_t field = 0;           // of the file
    Field description{};             // of that field
    std::vector<std::uint8_t> hides; // [Field::max_stored() + 1]: 1 for a stored value that is not drawn
};

// Whether a model has classes: a field "classification" or "class", in any case of ASCII letters.
bool has_classes(const ModelParameters &parameters);

// Points without a class are drawn unless `choice` names those to show.
//
// errors  usage  the model has no classes
Result<HiddenClasses> hidden_classes(const ModelParameters &parameters, const ClassChoice &choice);

} // namespace pbm
