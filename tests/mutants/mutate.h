// Makes a damaged file of an honest one.
#pragma once

#include "mutants/honest_files.h"
#include "unit/support/random.h"

#include <optional>
#include <span>
#include <string>

namespace pbm::mutants {

using test::Random;

struct Mutant {
    const HonestFile *origin = nullptr;
    std::string bytes;
    std::string story;                 // what was done to it
    std::optional<std::size_t> cut_at; // set if all that was done is to cut the file there
};

// One to three mutations: cuts; bytes or lines removed, doubled or exchanged; flipped bits; numbers and counts changed;
// garbage; other line ends; the end of another file. The same random numbers give the same mutant.
Mutant mutate(std::span<const HonestFile> files, std::size_t origin, Random random);

} // namespace pbm::mutants
