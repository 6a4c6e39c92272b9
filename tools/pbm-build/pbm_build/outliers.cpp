#include "pbm_build/outliers.h"

#include "pbm_format/parallel.h"

#include <algorithm>

namespace pbm::build {

Bytes find_outliers(const PointLinks &links, int threads) {
    constexpr std::size_t kBlock = 65536;
    const std::size_t count = links.spacing.size();
    Bytes outliers(count);
    if (count <= kLinks)
        return outliers;
    std::vector<float> sorted = links.spacing;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double least = kOutlierFactor * static_cast<double>(*middle);
    parallel_for((count + kBlock - 1) / kBlock, threads, [&](std::size_t block) {
        for (std::size_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) {
            const auto spacing = static_cast<double>(links.spacing[i]);
            if (!(spacing > least))
                continue;
            std::array<float, kLinks> around{};
            for (std::size_t k = 0; k < kLinks; ++k)
                around[k] = links.spacing[links.nearest[i * kLinks + k]];
            std::nth_element(around.begin(), around.begin() + kLinks / 2, around.end());
            outliers[i] = spacing > kOutlierFactor * static_cast<double>(around[kLinks / 2]) ? 1 : 0;
        }
    });
    return outliers;
}

} // namespace pbm::build
