// Recipes: the options of a build in a TOML file, under their long names.
//
//   input = "ammonite.ply"     names of files are relative to the recipe's folder
//   depth = 9
//   colour = "565"
//   strict = true
#pragma once

#include "command_line/setting.h"

namespace pbm::build {

// The keys of a recipe in the order of its lines.
//
// errors  io     the system's own text
//         usage  no TOML; a table, a date, an array of arrays or of several types; larger than 1 MiB. Lines are named.
Result<std::vector<command_line::Setting>> read_recipe(const std::string &path);

} // namespace pbm::build
