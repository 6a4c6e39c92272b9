// How the samples of one scan are divided among several builders.
#pragma once

#include "pbm_build/voxels/sample_points.h"

#include <cstdint>

namespace pbm::build {

// One of several parts of a scan.
struct PartNumber {
    std::uint64_t index = 0, count = 1; // index < count
    bool operator==(const PartNumber &) const = default;
};

// The buckets of a part. All parts together have all buckets, in ascending order, and about equally many sources begin
// in each. The result depends on the sampler's surface and grid only.
BucketRange buckets_of_part(const SurfaceSampler &sampler, const PartNumber &part, int depth);

} // namespace pbm::build
