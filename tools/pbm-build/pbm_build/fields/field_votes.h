// The stored values of fields of the voxels of a block, from all their samples. Sums are integers, so that the order of
// samples does not matter.
#pragma once

#include "pbm_build/fields/field_choice.h"

#include <cstdint>
#include <span>
#include <vector>

namespace pbm::build {

class FieldVotes {
  public:
    explicit FieldVotes(FieldAverage average) : average_(average) {}

    // Starts a block of so many voxels.
    void begin(std::size_t voxels);
    // Adds a sample: a value of FieldSamples, or kNone.
    void add(std::size_t voxel, std::int32_t value);
    // Appends the stored values of all voxels, 0 where no sample has a value, as `bytes` bytes each.
    void append(std::uint8_t bytes, Bytes &column);

  private:
    struct Sums {
        std::int64_t sum = 0; // or the largest value
        std::uint32_t count = 0;
    };

    FieldAverage average_;
    std::vector<Sums> sums_;
    std::vector<std::uint64_t> labels_; // voxel and value, of the majority
};

} // namespace pbm::build
