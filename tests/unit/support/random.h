// Random numbers that are the same on every platform, so that a test or a mutant is known by its seed.
// Based on: Steele, Lea, Flood. Fast splittable pseudorandom number generators. 2014
#pragma once

#include <cstdint>

namespace pbm::test {

class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next() {
        std::uint64_t z = state_ += 0x9E3779B97F4A7C15;
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9;
        z = (z ^ z >> 27) * 0x94D049BB133111EB;
        return z ^ z >> 31;
    }
    // 0 <= result < limit, which is not zero.
    std::uint64_t below(std::uint64_t limit) { return next() % limit; }
    double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

  private:
    std::uint64_t state_;
};

} // namespace pbm::test
