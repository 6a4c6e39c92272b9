// The files of format_spec/vectors. Of invalid/ each breaks one rule of BVG.md, with every hash in front of it right;
// of advised/ each is valid, and of one code of the catalogue that is no error.
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
