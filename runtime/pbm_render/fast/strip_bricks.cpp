#include "pbm_render/fast/strip_bricks.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace pbm {
namespace {

// More of them hide hardly more bricks, and cut the runs into pieces with too few points for SIMD.
constexpr std::size_t kDepthClasses = 8;

} // namespace

void StripBricks::collect(const DrawnRuns &drawn, int top, int bottom) {
    runs_.clear();
    unsorted_.clear();
    float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
    drawn.for_each_in_rows(top, bottom,
                           [&](const RunGeometry &run, std::span<const VisibleBrick> seen, std::uint32_t first_id) {
                               for (std::size_t i = 0; i < seen.size(); ++i) {
                                   if (seen[i].top >= bottom || seen[i].bottom <= top)
                                       continue;
                                   unsorted_.push_back({static_cast<std::uint32_t>(runs_.size()),
                                                        static_cast<std::uint32_t>(i), !seen[i].has_fronts});
                                   nearest = std::min(nearest, seen[i].nearest);
                                   farthest = std::max(farthest, seen[i].nearest);
                               }
                               runs_.push_back({&run, seen, first_id});
                           });
    const float scale = farthest > nearest ? kDepthClasses / (farthest - nearest) : 0;
    const auto depth_class = [&](const Brick &brick) {
        const float depth = (runs_[brick.run].seen[brick.seen].nearest - nearest) * scale;
        return std::min(static_cast<std::size_t>(depth), kDepthClasses - 1) + (brick.only_backs ? kDepthClasses : 0);
    };
    std::array<std::size_t, 2 * kDepthClasses + 1> starts{};
    for (const Brick &brick : unsorted_)
        ++starts[depth_class(brick) + 1];
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    bricks_.resize(unsorted_.size());
    for (const Brick &brick : unsorted_)
        bricks_[starts[depth_class(brick)]++] = brick;
}

} // namespace pbm
