#include "pbm_build/normals/fit_planes.h"

#include "system/threads/parallel.h"

#include <algorithm>
#include <numeric>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr std::array<std::size_t, 3> kScales{kMinNeighbours, 18, kMaxNeighbours};
constexpr double kSmooth = 0.03; // roughness up to which the smallest scale will do

using Planes = PlaneColumns::Planes;

// Fits planes to the points of one block.
class BlockFitter {
  public:
    BlockFitter(const PointNeighbours &neighbours, PlaneFits &fits)
        : points_(neighbours.points()), fits_(fits), cursor_(neighbours) {}

    // Fits planes to some points at the smallest `scales` of kScales. Returns those that are not smooth.
    std::vector<std::uint32_t> fit(std::span<const std::uint32_t> some, std::size_t scales) {
        std::vector<std::uint32_t> rough;
        for (; !some.empty(); some = some.subspan(std::min(some.size(), PlaneColumns::kRows))) {
            const auto rows = some.first(std::min(some.size(), PlaneColumns::kRows));
            const std::size_t near = find_neighbours(rows, kScales[scales - 1]);
            for (std::size_t scale = 0; scale < scales; ++scale)
                fit_scale(std::min(near, kScales[scale]), scale);
            columns_.find_borders(std::min(near, kMinNeighbours), best_, at_border_);
            columns_.measure(std::min(near, kLinks), spacing_);
            for (std::size_t row = 0; row < rows.size(); ++row) {
                const std::uint32_t point = rows[row];
                fits_.links.spacing[point] = spacing_[row];
                fits_.normals[point] =
                    to_short_normal({best_.normals[0][row], best_.normals[1][row], best_.normals[2][row]});
                fits_.at_border[point] = at_border_[row];
                if (best_.roughness[row] > kSmooth)
                    rough.push_back(point);
            }
        }
        return rough;
    }

  private:
    // Fills a row for each point, and keeps its links. Returns the number of neighbours, at most `most`.
    std::size_t find_neighbours(std::span<const std::uint32_t> rows, std::size_t most) {
        std::array<NearPoint, kMaxNeighbours> room;
        std::size_t near = 0;
        for (std::size_t row = 0; row < rows.size(); ++row) {
            const std::uint32_t point = rows[row];
            const auto found = std::span(room).first(cursor_.nearest(point, std::span(room).first(most)));
            near = found.size();
            for (std::size_t k = 0; k < near; ++k) {
                const LatticePoint offset = points_[found[k].point] - points_[point];
                for (const int axis : {0, 1, 2})
                    columns_.offsets[k][static_cast<std::size_t>(axis)][row] = offset[axis];
            }
            for (std::size_t k = 0; k < kLinks; ++k)
                fits_.links.nearest[point * kLinks + k] = k < near ? found[k].point : point;
        }
        return near;
    }

    // Keeps the smoothest of the planes so far.
    void fit_scale(std::size_t count, std::size_t scale) {
        columns_.fit(std::max<std::size_t>(count, 1), scale == 0 ? best_ : planes_);
        for (std::size_t row = 0; scale > 0 && row < PlaneColumns::kRows; ++row)
            if (planes_.roughness[row] < best_.roughness[row]) {
                best_.roughness[row] = planes_.roughness[row];
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    best_.normals[axis][row] = planes_.normals[axis][row];
                    best_.along[axis][row] = planes_.along[axis][row];
                }
            }
    }

    const std::vector<LatticePoint> &points_;
    PlaneFits &fits_;
    NeighbourCursor cursor_;
    PlaneColumns columns_;
    Planes best_{}, planes_{};
    PlaneColumns::Column<std::uint8_t> at_border_{};
    PlaneColumns::Column<float> spacing_{};
};

} // namespace

PlaneFits fit_planes(const PointNeighbours &neighbours, int threads) {
    const std::size_t count = neighbours.points().size();
    PlaneFits fits{{std::vector<std::uint32_t>(count * kLinks), std::vector<float>(count)},
                   std::vector<ShortNormal>(count),
                   Bytes(count)};
    parallel_blocks(count, kBlock, threads, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> all(end - begin);
        std::iota(all.begin(), all.end(), static_cast<std::uint32_t>(begin));
        const std::vector<std::uint32_t> rough = BlockFitter(neighbours, fits).fit(all, 1);
        BlockFitter(neighbours, fits).fit(rough, kScales.size());
    });
    return fits;
}

} // namespace pbm::build
