// The field in whose colours a model is drawn, by its name.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/field_colours.h"

#include <string>
#include <vector>

namespace pbm {

bool has_field(const ModelParameters &parameters, const std::string &name);

// Reads the coarse levels of the field, up to the last one that is a single chunk, for its usual range and its labels.
// The case of ASCII letters in `name` does not matter.
//
// errors  usage  the file has no such field; the message lists those that it has
//         and those of the reader: the file is damaged
Result<FieldColours> choose_field_colours(Reader &reader, const std::string &name, const ColourChoice &choice);
// The ranges of the file that it reads, and that a StreamedModel with these colours opens with. None without fields.
std::vector<FileRange> field_sample_ranges(const Reader &reader);

} // namespace pbm
