#include "pbm_build/parts/bucket_ranges.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace pbm::build {

BucketRange buckets_of_part(const SurfaceSampler &sampler, const PartNumber &part, int depth) {
    const int level = HitStore::bucket_level(depth), local_bits = 3 * (depth - level);
    std::vector<std::uint64_t> begun(std::size_t{1} << 3 * level, 0); // sources, by the bucket of their first corner
    if (part.count == 1)
        return {0, begun.size()};
    for (std::size_t i = 0; i < sampler.source_count(); ++i)
        ++begun[sampler.first_voxel(i) >> local_bits];
    std::inclusive_scan(begun.begin(), begun.end(), begun.begin());
    // Behind the bucket with which the parts up to here have their share.
    const auto end_of = [&](std::uint64_t parts) {
        const auto share = static_cast<std::uint64_t>(static_cast<double>(begun.back()) * static_cast<double>(parts) /
                                                      static_cast<double>(part.count));
        const auto last = std::lower_bound(begun.begin(), begun.end(), share);
        return parts == part.count ? begun.size() : static_cast<std::size_t>(last - begun.begin()) + 1;
    };
    return {part.index == 0 ? 0 : end_of(part.index), end_of(part.index + 1)};
}

} // namespace pbm::build
