// Random numbers that are the same everywhere, so that a mutant is known by its number.
// Based on: Steele, Lea, Flood. Fast splittable pseudorandom number generators. 2014
#pragma once

#include <cstddef>
#include <cstdint>

namespace pbm::mutants {

class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() {
        std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
        return z ^ (z >> 31);
    }
    // 0 <= result < bound, which is not zero.
    std::size_t below(std::size_t bound) { return static_cast<std::size_t>(next() % bound); }

  private:
    std::uint64_t state_;
};

} // namespace pbm::mutants
