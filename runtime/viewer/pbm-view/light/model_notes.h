// What a model's metadata says to people, and the view that it asks a window to start with.
#pragma once

#include "pbm_format/model/model.h"
#include "viewer/cameras/model_views.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

struct ModelNotes {
    std::string name, credit, licence;  // empty: not said
    std::vector<std::string> materials; // names that pbm-build was given, in order
    std::optional<SavedView> view;      // usable
};
// Ignores what it does not understand.
ModelNotes read_notes(std::string_view metadata);

// "Light 2 (spot)".
std::string light_name(const Light &light, std::size_t index);
// The preset that the material equals, else the one that it was made from, else only its number: "Material 1 (gold)".
std::string material_name(const Material &material, std::size_t index, const ModelNotes &notes);

} // namespace pbm
