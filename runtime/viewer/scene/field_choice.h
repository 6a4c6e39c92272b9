// The field in whose colours a model is drawn, as the user names it.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/field_colours.h"
#include "viewer/options/look_options.h"

namespace pbm {

bool has_field(const ModelParameters &parameters, const std::string &name);

// Reads the coarse levels of the field, up to the last one that is a single chunk, for its usual range and its labels.
//
// errors  usage  the file has no such field; the message lists those that it has
//         and those of the reader: the file is damaged
Result<FieldColours> choose_field_colours(Reader &reader, const ColourBy &wanted);

} // namespace pbm
