#include "sweeps.h"

#include "pbm-sample/noise/deterministic_math.h"

#include <algorithm>

namespace pbm::sample {

namespace {

Vec3 vector(const std::array<float, 3> &a) { return {a[0], a[1], a[2]}; }

Vec3 cross(const Vec3 &a, const Vec3 &b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

} // namespace

Sweeps::Sweeps(const Surface &surface, std::uint64_t points)
    : points_(points), meridian_(kRows + 1), area_below_(kRows + 1), around_(kRows * (kColumns + 1)) {
    std::vector<float> v(kColumns + 1);
    for (std::size_t column = 0; column <= kColumns; ++column)
        v[column] = static_cast<float>(column % kColumns) / kColumns;
    std::vector<std::array<float, 3>> below(v.size()), above(v.size());
    surface(0, v, below);
    double length_sum = 0;
    for (std::size_t row = 0; row < kRows; ++row) {
        surface(static_cast<double>(row + 1) / kRows, v, above);
        float *const shares = &around_[row * (kColumns + 1)];
        double row_area = 0, row_length = 0;
        for (std::size_t column = 0; column < kColumns; ++column) {
            const Vec3 a = vector(below[column]), b = vector(below[column + 1]);
            const Vec3 c = vector(above[column]), d = vector(above[column + 1]);
            row_area += 0.5 * length(cross(d - a, c - b));
            row_length += length(c - a);
            shares[column + 1] = static_cast<float>(row_area);
        }
        const auto scale = static_cast<float>(1.0 / row_area);
        for (std::size_t column = 1; column < kColumns; ++column)
            shares[column] = std::min(shares[column] * scale, 1.0f);
        shares[kColumns] = 1;
        length_sum += row_length / kColumns;
        area_ += row_area;
        meridian_[row + 1] = length_sum;
        area_below_[row + 1] = area_;
        below.swap(above);
    }
    for (std::size_t row = 1; row <= kRows; ++row) {
        meridian_[row] /= length_sum;
        area_below_[row] /= area_;
    }
    const double spacing = std::sqrt(area_ / static_cast<double>(points));
    sweeps_ = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(length_sum / spacing + 0.5));
}

double Sweeps::u_at(std::uint64_t sweep) const {
    if (sweep == sweeps_)
        return 1;
    const double share = static_cast<double>(sweep) / static_cast<double>(sweeps_);
    const auto above = std::upper_bound(meridian_.begin() + 1, meridian_.end() - 1, share);
    const auto row = static_cast<double>(above - meridian_.begin() - 1);
    return (row + (share - above[-1]) / (*above - above[-1])) / kRows;
}

std::uint64_t Sweeps::first_of(std::uint64_t sweep) const {
    if (sweep == sweeps_)
        return points_;
    const double row = u_at(sweep) * kRows;
    const auto below = std::min(static_cast<std::size_t>(row), kRows - 1);
    // Rounding may not reach beyond the row: no sweep begins behind the next one.
    const double share = std::min(area_below_[below + 1],
                                  mix(area_below_[below], area_below_[below + 1], row - static_cast<double>(below)));
    return std::min(points_, static_cast<std::uint64_t>(share * static_cast<double>(points_)));
}

Sweeps::Sweep Sweeps::sweep_number(std::uint64_t number) const {
    const std::uint64_t first = first_of(number);
    const double u = u_at(number);
    return {number, first, first_of(number + 1) - first, u, u_at(number + 1) - u};
}

Sweeps::Sweep Sweeps::sweep_of(std::uint64_t point) const {
    std::uint64_t low = 0, high = sweeps_; // first_of(low) <= point < first_of(high)
    while (high - low > 1) {
        const std::uint64_t middle = low + (high - low) / 2;
        (first_of(middle) <= point ? low : high) = middle;
    }
    return sweep_number(low);
}

double Sweeps::around(const Sweep &sweep, double part, std::size_t &column) const {
    const auto row = std::min(static_cast<std::size_t>((sweep.u + 0.5 * sweep.width) * kRows), kRows - 1);
    const float *const shares = &around_[row * (kColumns + 1)];
    while (column > 0 && static_cast<double>(shares[column]) > part)
        --column;
    while (column + 1 < kColumns && static_cast<double>(shares[column + 1]) <= part)
        ++column;
    const auto low = static_cast<double>(shares[column]), high = static_cast<double>(shares[column + 1]);
    const double within = high > low ? (part - low) / (high - low) : 0.5;
    return (static_cast<double>(column) + within) / kColumns;
}

} // namespace pbm::sample
