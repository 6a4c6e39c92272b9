#include "pbm_render/fine/sample_sums.h"

#include <cmath>

namespace pbm {
namespace {

void repeat_ends(std::vector<Float4> &row) {
    row.front() = row[1];
    row.back() = row[row.size() - 2];
}

Float4 absolute(Float4 v) { return v < 0 ? -v : v; }
Float4 larger(Float4 a, Float4 b) { return a > b ? a : b; }

} // namespace

// Square roots of the light in a row, background included, and alpha.
void SampleSums::look_at(int y, Float4 behind, std::vector<Float4> &to) const {
    const Float4 *const sums = sums_at(y);
    for (int x = 0; x < width_; ++x) {
        const Float4 sum = sums[x], light = sum + behind * (1 - sum[3]);
        Float4 root{0, 0, 0, sum[3]};
        for (int k = 0; k < 3; ++k)
            root[k] = std::sqrt(std::clamp(light[k], 0.0F, 1.0F));
        to[static_cast<std::size_t>(x) + 1] = root;
    }
    repeat_ends(to);
}

void SampleSums::choose_row(const Rows &rows, int y) {
    const Float4 *const above = rows.pixels(y - 1), *const here = rows.pixels(y), *const below = rows.pixels(y + 1);
    const std::span<std::uint64_t> bits = chosen_.row(y);
    std::fill(bits.begin(), bits.end(), 0);
    for (int x = 0; x < width_; ++x) {
        const Float4 four = 4 * here[x];
        const Float4 across = above[x] + below[x] + here[x - 1] + here[x + 1] - four,
                     diagonal = above[x - 1] + above[x + 1] + below[x - 1] + below[x + 1] - four;
        const Float4 most = larger(absolute(across), absolute(diagonal) / 2);
        if (most[0] > kMaxCurvature || most[1] > kMaxCurvature || most[2] > kMaxCurvature || most[3] > kMaxCurvature)
            bits[static_cast<std::size_t>(x / PixelBits::kBits)] |= std::uint64_t{1} << (x % PixelBits::kBits);
    }
    if (chooses_beside_) {
        widen(bits, 1);
        bits.back() &= bits_between(0, width_, static_cast<int>(bits.size() - 1) * PixelBits::kBits);
    }
}

void SampleSums::find_means(int y, int samples, std::vector<Float4> &to) const {
    const Float4 *const sums = sums_at(y);
    std::copy_n(sums, width_, to.begin() + 1);
    if (has_choice())
        for_each_bit(chosen_.row(std::clamp(y, 0, height_ - 1)),
                     [&](int x) { to[static_cast<std::size_t>(x) + 1] /= static_cast<float>(samples); });
    repeat_ends(to);
}

// The mean of a smooth function over a square of edge 1 is its value in the middle, and a 24th of its second
// derivatives' sum.
void SampleSums::smooth_row(const Rows &rows, int y, std::vector<Float4> &to) const {
    const Float4 *const above = rows.pixels(y - 1), *const here = rows.pixels(y), *const below = rows.pixels(y + 1);
    std::copy_n(here, width_, to.begin());
    if (!has_choice())
        return;
    for (int x = 0; x < width_; ++x)
        to[static_cast<std::size_t>(x)] += (above[x] + below[x] + here[x - 1] + here[x + 1] - 4 * here[x]) / 24;
    for_each_bit(chosen_.row(y), [&](int x) { to[static_cast<std::size_t>(x)] = here[x]; });
}

} // namespace pbm
