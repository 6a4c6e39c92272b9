#include "pbm_render/appearance/hidden_classes.h"

#include "pbm_render/appearance/field_choice.h"

#include <cmath>

namespace pbm {

namespace {

const Field *find_classes(const std::vector<Field> &fields) {
    const Field *const usual = find_field(fields, "classification");
    return usual != nullptr ? usual : find_field(fields, "class");
}

} // namespace

bool has_classes(const ModelParameters &parameters) { return find_classes(parameters.fields) != nullptr; }

Result<HiddenClasses> hidden_classes(const ModelParameters &parameters, const ClassChoice &choice) {
    const Field *const field = find_classes(parameters.fields);
    if (field == nullptr)
        return usage_error("the model has no classes, which --drop-class and --show-class choose from; build it with "
                           "pbm-build --field classification");
    HiddenClasses hidden{.field = static_cast<std::size_t>(field - parameters.fields.data()),
                         .description = *field,
                         .hides = std::vector<std::uint8_t>(field->max_stored() + 1)};
    hidden.hides[0] = choice.shown ? 1 : 0;
    for (std::uint32_t stored = 1; stored < hidden.hides.size(); ++stored) {
        const double number = std::round(field->value(stored));
        const bool is_class = number >= 0 && number < static_cast<double>(choice.dropped.size());
        const std::size_t of = is_class ? static_cast<std::size_t>(number) : 0;
        const bool is_hidden = (is_class && choice.dropped[of]) || (choice.shown && !(is_class && (*choice.shown)[of]));
        hidden.hides[stored] = is_hidden ? 1 : 0;
    }
    return hidden;
}

} // namespace pbm
