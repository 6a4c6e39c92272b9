#include "statue.h"

#include "paint.h"
#include "statue_shape.h"
#include "sweeps.h"

#include "pbm-sample/noise/jet_noise.h"
#include "pbm-sample/noise/noise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>

namespace pbm::sample {

namespace {

Sweeps statue_sweeps(std::uint64_t points, std::uint32_t seed) {
    const Surface surface = [seed](double u, const std::vector<float> &v, std::vector<std::array<float, 3>> &out) {
        for (std::size_t i = 0; i < v.size(); ++i) {
            const CapsulePlace place = capsule_place(all(static_cast<float>(u)), all(v[i]));
            const Lanes3 at = place.at(statue_radius(place, seed).radius.value);
            out[i] = {at.x[0], at.y[0], at.z[0]};
        }
    };
    return {surface, points};
}

// Grey veins in white marble; brown dirt in cavities, and some on what faces up.
Paint marble_color(const Lanes3 &place, const StatueRadius &surface, Float4 up, std::uint32_t seed) {
    const Float4 cloud = gradient_noise(place.x * 6.0f, place.y * 4.0f, place.z * 6.0f, seed + 30).value;
    const Float4 bend = 2.0f * cloud;
    const Float4 vein =
        gradient_noise(place.x * 9.0f + bend, place.y * 7.0f + bend, place.z * 9.0f - bend, seed + 31).value;
    const Float4 grey = 0.7f * (1.0f - smooth_step(0.0f, 0.09f, larger(vein, -vein))) + 0.3f * clamp01(cloud + 0.4f);
    const Float4 dirt = clamp01(0.75f * surface.cavity + 0.22f * smooth_step(0.2f, 0.9f, up + 0.4f * cloud));
    return mix(mix(paint(238, 233, 223), paint(176, 176, 172), grey), paint(120, 104, 84), dirt);
}

// Walks the cells of the sweeps in the order of points.
class Walk {
  public:
    Walk(const Sweeps &sweeps, std::uint64_t point)
        : sweeps_(sweeps), sweep_(sweeps.sweep_of(point)), inside_(point - sweep_.first) {}

    // Parameters of the place in the current cell that `across` and `along`, both in [0, 1), choose; then steps on.
    std::pair<float, float> next(double across, double along) {
        while (inside_ == sweep_.points) {
            sweep_ = sweeps_.sweep_number(sweep_.number + 1);
            inside_ = 0;
        }
        const double part = (static_cast<double>(inside_++) + along) / static_cast<double>(sweep_.points);
        const double v = sweeps_.around(sweep_, part, column_);
        return {static_cast<float>(sweep_.u + across * sweep_.width), static_cast<float>(v)};
    }

  private:
    const Sweeps &sweeps_;
    Sweeps::Sweep sweep_;
    std::uint64_t inside_;
    std::size_t column_ = 0;
};

} // namespace

PointScan make_statue(std::uint64_t points, std::uint32_t seed) {
    assert(points >= 1 && points <= kMaxPoints);
    const auto stone = static_cast<std::uint32_t>(hash_bits(seed));
    const auto sweeps = std::make_shared<const Sweeps>(statue_sweeps(points, stone));
    const double spacing = std::sqrt(sweeps->area() / static_cast<double>(points));
    const auto noise = static_cast<float>(std::min(1e-4, spacing / 16));
    const auto fill = [sweeps, noise, stone](std::uint64_t first, std::span<ScanPoint> out) {
        Walk walk(*sweeps, first);
        for (std::size_t begin = 0; begin < out.size(); begin += kLanes) {
            const int lanes = static_cast<int>(std::min<std::size_t>(kLanes, out.size() - begin));
            Float4 u = all(0.5f), v = all(0), error = all(0), shade = all(0);
            for (int lane = 0; lane < lanes; ++lane) {
                const Scatter scatter = scatter_of(first + begin + static_cast<unsigned>(lane), stone);
                const auto [cell_u, cell_v] = walk.next(scatter.across, scatter.along);
                u[lane] = cell_u;
                v[lane] = cell_v;
                error[lane] = scatter.error;
                shade[lane] = scatter.shade;
            }
            const CapsulePlace place = capsule_place(u, v);
            const StatueRadius surface = statue_radius(place, stone);
            const Lanes3 normal = statue_normal(place, surface.radius);
            const Lanes3 at = place.at(surface.radius.value + error * noise);
            const Paint color = marble_color(place.position(), surface, normal.y, stone);
            for (int lane = 0; lane < lanes; ++lane) {
                out[begin + static_cast<unsigned>(lane)] = {{at.x[lane], at.y[lane], at.z[lane]},
                                                            {normal.x[lane], normal.y[lane], normal.z[lane]},
                                                            color_of(color, lane, 1.0f + 0.02f * shade[lane])};
            }
        }
    };
    return {points, spacing, fill};
}

} // namespace pbm::sample
