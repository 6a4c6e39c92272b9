// The files of format_spec/vectors. Each file of invalid/ violates one rule of BVG.md, and every hash checked before
// that rule is right. Each file of advised/ is valid and gets one code of the catalogue that is not an error.
#pragma once

#include "system/bytes.h"

#include <string>
#include <vector>

namespace pbm::test {

struct ValidFile {
    std::string name; // file name without folder
    Bytes bytes;
};

struct InvalidFile {
    std::string name; // starts with the number of the rule: "2.9-depth-1.pbvg"
    Bytes bytes;
};

std::vector<ValidFile> valid_files();
std::vector<InvalidFile> invalid_files();
std::vector<ValidFile> advised_files(); // "metadata.path.pbvg": the code is the name

} // namespace pbm::test
