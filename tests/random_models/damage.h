// Files that are damaged and signed again: every hash is right, so that the rule behind the hash is what is tried.
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
    std::string story; // what was done, for who has to look into it
};

// One to four edits of a valid file: bits, fields of header, table, directories and rasters set to values at an edge,
// ranges copied, records exchanged, the end cut or continued. Then all hashes are made right; and half the time the
// content_id too, so that what is still a model is a valid one.
Damaged damage(Bytes file, const Choose &choose);

} // namespace pbm::test
