// What a model is coloured by, chosen by its name: a field, or what every model has.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/field_colours.h"

#include <optional>
#include <string>
#include <vector>

namespace pbm {

// A name is that of a field of the file, in any case of ASCII letters. Where no field has it:
//
//   height, normal, plain   what every model has: ColourBasis
//   class, return           the fields "classification" and "return_number"

// The field that a name stands for; null: none.
const Field *find_field(const std::vector<Field> &fields, const std::string &name);
// Whether the model can be coloured by that name.
bool can_colour_by(const ModelParameters &parameters, const std::string &name);
// The names of all that it can be coloured by.
std::vector<std::string> colour_names(const ModelParameters &parameters);
// The field that a model must have to be coloured by that name; empty: none. For scans, which keep it then.
std::string field_to_keep(const std::string &name);

// Reads the coarse levels, up to the last one that is a single chunk, for the usual range and the labels. `up`: the
// axis of heights; absent: that of the grid.
//
// errors  usage  the file has no such field; the message lists those that it has
//         and those of the reader: the file is damaged
Result<FieldColours> choose_field_colours(Reader &reader, const std::string &name, const ColourChoice &choice,
                                          std::optional<UpAxis> up = {});
// The ranges of the file that it reads, and that a StreamedModel with these colours opens with.
std::vector<FileRange> colour_sample_ranges(const Reader &reader, const std::string &name);

// Whether all points have the same colour, which is then one of paint or of a default rather than of photographs; false
// for points without colours and for models with lights, which light all colours alike. Reads the first three levels.
//
// errors  those of the reader: the file is damaged
Result<bool> has_one_colour(Reader &reader);
// The ranges of the file that it reads.
std::vector<FileRange> one_colour_ranges(const Reader &reader);

} // namespace pbm
