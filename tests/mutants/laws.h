// What must hold for every mutant, whatever a reader makes of it.
#pragma once

#include "mutants/mutate.h"

#include <cstdint>
#include <optional>
#include <string>

namespace pbm::mutants {

enum class Verdict : std::uint8_t { loaded, loaded_less, refused, unsupported, broken };

struct Judgement {
    Verdict verdict = Verdict::broken; // loaded_less: and said that something was dropped
    std::string text;                  // the reader's error; of a broken law: which one
};

// Reads the mutant and holds the result against the laws of README.md. What hangs or crashes does not come back: call
// it in a child process.
Judgement judge(const Mutant &mutant);

} // namespace pbm::mutants
