#include "terrain.h"

#include "paint.h"

#include "pbm-sample/noise/jet_noise.h"
#include "pbm-sample/noise/noise.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace pbm::sample {

namespace {

constexpr std::uint64_t kStrips = 8;
constexpr double kStripWidth = kTerrainEdge / static_cast<double>(kStrips);

// Ridges where the noise is zero. Each octave counts as far as the one before is high, so that valleys stay smooth.
// In about [0, 2].
Jet2 ridges(const Jet2 &x, const Jet2 &z, std::uint32_t seed) {
    Jet2 sum = constant<2>(all(0)), weight = constant<2>(all(1));
    float frequency = 1.0f / 1300.0f, amplitude = 1.0f, rounding = 0.015f;
    for (std::uint32_t octave = 0; octave < 8; ++octave) {
        const Jet2 noise = noise_of(x, z, frequency, seed + octave);
        const Jet2 ridge = square(1.0f - rounded_abs(noise * 1.5f, rounding)) * weight;
        sum = sum + ridge * amplitude;
        weight = smooth_step(-0.25f, 0.8f, ridge);
        frequency *= 2.17f; // not 2, so that zeros of the octaves do not coincide; 6 m in the end
        amplitude *= 0.5f;
        rounding *= 1.3f;
    }
    return sum;
}

struct Strip {
    std::uint64_t first, points, lines;
};

Strip strip_of(std::uint64_t number, std::uint64_t points) {
    const std::uint64_t first = number * points / kStrips;
    const std::uint64_t count = (number + 1) * points / kStrips - first;
    const double lines = std::sqrt(static_cast<double>(count) * kTerrainEdge / kStripWidth);
    return {first, count,
            std::clamp<std::uint64_t>(static_cast<std::uint64_t>(lines + 0.5), 1, std::max<std::uint64_t>(count, 1))};
}

// Walks the points of the scan in order.
class Flight {
  public:
    Flight(std::uint64_t point, std::uint64_t points) : points_(points) {
        strip_number_ = ((point + 1) * kStrips - 1) / points;
        strip_ = strip_of(strip_number_, points);
        const std::uint64_t inside = point - strip_.first;
        begin_line(((inside + 1) * strip_.lines - 1) / strip_.points);
        in_line_ = inside - first_in_line_;
    }

    // Where the cell of the current point lies, in metres from the land's corner, and its size; then steps on.
    struct Cell {
        double x, z, width, depth;
    };
    Cell next() {
        if (in_line_ == line_points_)
            next_line();
        const std::uint64_t across = line_ % 2 == 0 ? in_line_ : line_points_ - 1 - in_line_;
        ++in_line_;
        return {line_x_, strip_z_ + static_cast<double>(across) * cell_depth_, cell_width_, cell_depth_};
    }

  private:
    void next_line() {
        std::uint64_t line = line_;
        do {
            if (++line == strip_.lines || strip_.points == 0) {
                strip_ = strip_of(++strip_number_, points_);
                line = 0;
            }
            if (strip_.points != 0)
                begin_line(line);
        } while (strip_.points == 0 || line_points_ == 0);
        in_line_ = 0;
    }

    void begin_line(std::uint64_t line) {
        line_ = line;
        first_in_line_ = line * strip_.points / strip_.lines;
        line_points_ = (line + 1) * strip_.points / strip_.lines - first_in_line_;
        const std::uint64_t along = strip_number_ % 2 == 0 ? line : strip_.lines - 1 - line;
        cell_width_ = kTerrainEdge / static_cast<double>(strip_.lines);
        cell_depth_ = kStripWidth / static_cast<double>(std::max<std::uint64_t>(line_points_, 1));
        line_x_ = static_cast<double>(along) * cell_width_;
        strip_z_ = static_cast<double>(strip_number_) * kStripWidth;
    }

    std::uint64_t points_, strip_number_ = 0, line_ = 0, first_in_line_ = 0, line_points_ = 0, in_line_ = 0;
    Strip strip_{};
    double cell_width_ = 0, cell_depth_ = 0, line_x_ = 0, strip_z_ = 0;
};

// Gravel at the river, meadows, woods on the slopes, rock where it is steep, snow on the heights.
// `up`: the normal's vertical component.
Paint land_color(Float4 x, Float4 z, Float4 height, Float4 up, std::uint32_t seed) {
    const Float4 broad = gradient_noise(x * (1.0f / 170.0f), z * (1.0f / 170.0f), seed + 40).value;
    const Float4 fine = gradient_noise(x * (1.0f / 19.0f), z * (1.0f / 19.0f), seed + 41).value;
    const Float4 patches = broad + 0.5f * fine;
    Paint out = mix(paint(124, 132, 74), paint(150, 142, 92), clamp01(patches + 0.5f));
    const Float4 woods = smooth_step(6, 30, height) * (1.0f - smooth_step(230, 330, height + 120.0f * patches)) *
                         smooth_step(-0.25f, 0.05f, patches + 0.1f);
    out = mix(out, mix(paint(52, 74, 42), paint(74, 94, 52), clamp01(fine + 0.5f)), woods);
    const Paint rock = mix(paint(112, 104, 96), paint(146, 136, 124), clamp01(patches + 0.5f));
    out = mix(out, rock, 1.0f - smooth_step(0.68f, 0.84f, up + 0.1f * patches));
    const Float4 snow = smooth_step(400, 500, height + 120.0f * patches) * smooth_step(0.62f, 0.78f, up);
    out = mix(out, paint(236, 240, 246), snow);
    return mix(paint(158, 152, 140), out, smooth_step(0.8f, 3.0f, height));
}

} // namespace

Jet2 terrain_height(Float4 x, Float4 z, std::uint32_t seed) {
    const Jet2 px = coordinate<2>(x, 0), pz = coordinate<2>(z, 1);
    const Jet2 wx = px + noise_of(px, pz, 1.0f / 900.0f, seed + 20) * 160.0f;
    const Jet2 wz = pz + noise_of(px, pz, 1.0f / 900.0f, seed + 21) * 160.0f;

    const Jet2 bumps = noise_of(px, pz, 1.0f / 90.0f, seed + 24);
    const Jet2 hills = noise_of(wx, wz, 1.0f / 640.0f, seed + 22) * 40.0f +
                       noise_of(wx, wz, 1.0f / 210.0f, seed + 23) * 10.0f + bumps * 2.0f;
    const Jet2 mountain = smooth_step(-0.45f, 0.5f, noise_of(wx, wz, 1.0f / 2100.0f, seed + 25));
    const Jet2 high = hills + ridges(wx, wz, seed) * (mountain * 380.0f + 60.0f) + 30.0f;

    // The river winds along x. Its flood plain is flat; the sides rise over 700 m.
    const Jet2 off = wz - noise_of(px, constant<2>(all(0.37f * 1700.0f)), 1.0f / 1700.0f, seed + 26) * 900.0f;
    const Jet2 away = rounded_abs(off, 6.0f);
    const Jet2 valley = mix((bumps + 1.0f) * 2.0f, high, smooth_step(70.0f, 800.0f, away));
    return valley * smooth_step(4.0f, 40.0f, away);
}

PointScan make_terrain(std::uint64_t points, std::uint32_t seed) {
    assert(points >= 1 && points <= kMaxPoints);
    const double spacing = kTerrainEdge / std::sqrt(static_cast<double>(points));
    const auto noise = static_cast<float>(std::min(0.05, spacing / 16));
    const auto land = static_cast<std::uint32_t>(hash_bits(seed));
    const auto fill = [points, noise, land](std::uint64_t first, std::span<ScanPoint> out) {
        Flight flight(first, points);
        for (std::size_t begin = 0; begin < out.size(); begin += kLanes) {
            const int lanes = static_cast<int>(std::min<std::size_t>(kLanes, out.size() - begin));
            Float4 x = all(0), z = all(0), error = all(0), shade = all(0);
            for (int lane = 0; lane < lanes; ++lane) {
                const Scatter scatter = scatter_of(first + begin + static_cast<unsigned>(lane), land);
                const Flight::Cell cell = flight.next();
                x[lane] = static_cast<float>(cell.x + scatter.across * cell.width - 0.5 * kTerrainEdge);
                z[lane] = static_cast<float>(cell.z + scatter.along * cell.depth - 0.5 * kTerrainEdge);
                error[lane] = scatter.error;
                shade[lane] = scatter.shade;
            }
            const Jet2 height = terrain_height(x, z, land);
            const Float4 up =
                1.0f / square_root(1.0f + height.slope[0] * height.slope[0] + height.slope[1] * height.slope[1]);
            const Paint color = land_color(x, z, height.value, up, land);
            const Float4 y = height.value + error * noise;
            const Float4 nx = -height.slope[0] * up, nz = -height.slope[1] * up;
            for (int lane = 0; lane < lanes; ++lane) {
                out[begin + static_cast<unsigned>(lane)] = {{x[lane], y[lane], z[lane]},
                                                            {nx[lane], up[lane], nz[lane]},
                                                            color_of(color, lane, 1.0f + 0.06f * shade[lane])};
            }
        }
    };
    return {points, spacing, fill};
}

} // namespace pbm::sample
