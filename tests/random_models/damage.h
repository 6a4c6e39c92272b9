// Damaged files with repaired hashes, so that the rules behind the hashes are tested.
#pragma once

#include "system/bytes.h"

#include <cstdint>
#include <functional>
#include <string>

namespace pbm::test {

// A number below `limit` (1 or more), from a seed or from a fuzzer's input.
using Choose = std::function<std::uint64_t(std::uint64_t limit)>;

struct Damaged {
    Bytes bytes;
    std::string story; // description of the edits, for debugging
};

// Applies one to four edits to a valid file: flips bits, sets fields to edge values, copies ranges, exchanges records,
// shortens or extends the file. Then repairs all hashes, and half the time the content_id too, so that a readable
// model is a valid file.
Damaged damage(Bytes file, const Choose &choose);

} // namespace pbm::test
