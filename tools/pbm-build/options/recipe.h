// Recipes: options of a build in a TOML file, with their long names as keys.
//
//   input = "ammonite.ply"     names of files are relative to the recipe's folder
//   depth = 9
//   colour = "565"
//   strict = true
//   [[light]]                  any number; the fields of --light
//   kind = "spot"
//   from = [-1, 2, 1.5]
#pragma once

#include "command_line/setting.h"

namespace pbm::build {

// Reads the keys of a recipe in the order of its lines; tables of lights and materials become the text of their option.
//
// errors  io     the system's own text
//         usage  no TOML; another table, a date, an array of arrays or of several types; larger than 1 MiB; the message
//                names the line
Result<std::vector<command_line::Setting>> read_recipe(const std::string &path);

} // namespace pbm::build
