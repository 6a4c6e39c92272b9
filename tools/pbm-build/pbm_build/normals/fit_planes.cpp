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
        : points_(neighbours.points()), fits_(fits), few_(neighbours), many_(neighbours) {}

    // All scales at once where most points need them, else those of the points that are not smooth behind all others.
    void fit(std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> all(end - begin), rough;
        std::iota(all.begin(), all.end(), static_cast<std::uint32_t>(begin));
        for_rows(all, [&](Rows rows) {
            const bool all_scales = 2 * rough_rows_ > PlaneColumns::kRows;
            fit_rows(rows, all_scales ? kScales.size() : 1);
            for (std::size_t row = 0; row < rows.size() && !all_scales; ++row)
                if (is_rough_[row] || is_narrow_[row])
                    rough.push_back(rows[row]);
        });
        for_rows(rough, [&](Rows rows) { fit_rows(rows, kScales.size()); });
    }

  private:
    using Rows = std::span<const std::uint32_t>; // the point of each row

    template <class Work> static void for_rows(Rows points, const Work &work) {
        for (std::size_t first = 0; first < points.size(); first += PlaneColumns::kRows)
            work(points.subspan(first, std::min(PlaneColumns::kRows, points.size() - first)));
    }

    // Fits planes at the smallest `scales` of kScales, only at the smallest one to points that are smooth there.
    void fit_rows(Rows rows, std::size_t scales) {
        const std::size_t near = find_neighbours(rows, scales == 1 ? few_ : many_, kScales[scales - 1]);
        columns_.fit(std::clamp<std::size_t>(near, 1, kScales[0]), best_);
        rough_rows_ = 0;
        for (std::size_t row = 0; row < rows.size(); ++row) {
            is_rough_[row] = best_.roughness[row] > kSmooth;
            is_narrow_[row] = best_.breadth[row] <= kLineBreadth;
            rough_rows_ += is_rough_[row] ? 1 : 0;
        }
        at_few_ = at_many_ = best_.roughness;
        for (std::size_t scale = 1; scale < scales; ++scale)
            improve(rows.size(), std::clamp<std::size_t>(near, 1, kScales[scale]));
        columns_.find_borders(std::min(near, kMinNeighbours), best_, at_border_);
        columns_.measure(std::min(near, kLinks), spacing_);
        for (std::size_t row = 0; row < rows.size(); ++row) {
            const std::uint32_t point = rows[row];
            fits_.links.spacing[point] = spacing_[row];
            fits_.normals[point] =
                to_short_normal({best_.normals[0][row], best_.normals[1][row], best_.normals[2][row]});
            fits_.at_border[point] = at_border_[row];
            const auto rounded = [](double roughness) { return static_cast<std::uint8_t>(255 * roughness + 0.5); };
            fits_.spreads[point] = {rounded(best_.roughness[row]), rounded(at_few_[row]), rounded(at_many_[row]),
                                    scales == kScales.size() && best_.breadth[row] <= kLineBreadth};
        }
    }

    // Fills a row for each point, and keeps its links. Returns the number of neighbours, at most `most`.
    std::size_t find_neighbours(Rows rows, NeighbourCursor &cursor, std::size_t most) {
        std::array<NearPoint, kMaxNeighbours> room;
        std::size_t near = 0;
        for (std::size_t row = 0; row < rows.size(); ++row) {
            const std::uint32_t point = rows[row];
            const auto found = std::span(room).first(cursor.nearest(point, std::span(room).first(most)));
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

    // Replaces the planes of rough points by those through `count` neighbours where these are smoother.
    void improve(std::size_t rows, std::size_t count) {
        columns_.fit(count, planes_);
        for (std::size_t row = 0; row < rows; ++row) {
            best_.breadth[row] = std::max(best_.breadth[row], planes_.breadth[row]);
            if (is_rough_[row])
                at_many_[row] = planes_.roughness[row];
            if (is_rough_[row] && planes_.roughness[row] < best_.roughness[row]) {
                best_.roughness[row] = planes_.roughness[row];
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    best_.normals[axis][row] = planes_.normals[axis][row];
                    best_.along[axis][row] = planes_.along[axis][row];
                }
            }
        }
    }

    const std::vector<LatticePoint> &points_;
    PlaneFits &fits_;
    NeighbourCursor few_, many_; // neighbours: for the smallest scale, for all
    PlaneColumns columns_;
    Planes best_{}, planes_{};
    PlaneColumns::Column<double> at_few_{}, at_many_{}; // roughness
    PlaneColumns::Column<bool> is_rough_{}, is_narrow_{};
    std::size_t rough_rows_ = 0; // of the rows before
    PlaneColumns::Column<std::uint8_t> at_border_{};
    PlaneColumns::Column<float> spacing_{};
};

} // namespace

PlaneFits fit_planes(const PointNeighbours &neighbours, int threads) {
    const std::size_t count = neighbours.points().size();
    PlaneFits fits{{std::vector<std::uint32_t>(count * kLinks), std::vector<float>(count)},
                   std::vector<ShortNormal>(count),
                   std::vector<Spread>(count),
                   Bytes(count)};
    parallel_blocks(count, kBlock, threads,
                    [&](std::size_t begin, std::size_t end) { BlockFitter(neighbours, fits).fit(begin, end); });
    return fits;
}

} // namespace pbm::build
