// Spreads points evenly over a closed surface, in the order of a scanner that turns around it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pbm::sample {

// Positions on a surface of the parameters u, along a meridian from pole to pole, and v, once around, both in [0, 1].
// `out`: one position per element of `v`.
using Surface = std::function<void(double u, const std::vector<float> &v, std::vector<std::array<float, 3>> &out)>;

// Parameters of points that lie in the cells of sweeps: a sweep is a band around the surface, of the same mean width
// for all sweeps; a cell is a part of it. All cells have nearly the same area. The areas come from a table of
// 512 x 256 patches of the surface (0.5 MB), whatever the number of points.
class Sweeps {
  public:
    Sweeps(const Surface &surface, std::uint64_t points);

    double area() const { return area_; }

    // One sweep: points `first` to `first + points` lie in it, and u between `u` and `u + width`.
    struct Sweep {
        std::uint64_t number = 0, first = 0, points = 0;
        double u = 0, width = 0;
    };
    Sweep sweep_of(std::uint64_t point) const; // point < points
    Sweep sweep_number(std::uint64_t number) const;
    std::uint64_t count() const { return sweeps_; }

    // The place v that has the share `part` of the sweep's area before it, 0 <= part < 1. `column` is where the search
    // begins, and then where it ended: points in order are found at once.
    double around(const Sweep &sweep, double part, std::size_t &column) const;

  private:
    static constexpr std::size_t kRows = 512, kColumns = 256;

    double u_at(std::uint64_t sweep) const;
    std::uint64_t first_of(std::uint64_t sweep) const;

    std::uint64_t points_, sweeps_ = 1;
    double area_ = 0;
    std::vector<double> meridian_, area_below_; // [kRows + 1] shares of the whole, 0 to 1
    std::vector<float> around_;                 // [kRows][kColumns + 1] shares of the row's area, 0 to 1
};

} // namespace pbm::sample
