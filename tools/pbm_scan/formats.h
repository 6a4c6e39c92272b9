// The table of the file formats of scans, a line each (formats.cpp). How to add one:
// docs/how-to/add-an-input-format.md.
#pragma once

#include "pbm_scan/surface/scan_format.h"

#include <span>
#include <string>

namespace pbm::build {

// Earlier ones win where several recognise a file.
std::span<const ScanFormat> scan_formats();

// "PLY, OBJ, ... or STL".
std::string names_of_formats();

} // namespace pbm::build
