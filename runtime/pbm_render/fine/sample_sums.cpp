#include "pbm_render/fine/sample_sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {
namespace {

void repeat_ends(std::vector<Float4> &row) {
    row.front() = row[1];
    row.back() = row[row.size() - 2];
}

Float4 absolute(Float4 v) { return v < 0 ? -v : v; }
Float4 larger(Float4 a, Float4 b) { return a > b ? a : b; }

// Whether a picture of light changes at a pixel by more than a plane does.
bool is_curved(const Float4 *above, const Float4 *here, const Float4 *below, int x) {
    const Float4 four = 4 * here[x];
    const Float4 across = above[x] + below[x] + here[x - 1] + here[x + 1] - four,
                 diagonal = above[x - 1] + above[x + 1] + below[x - 1] + below[x + 1] - four;
    const Float4 most = larger(absolute(across), absolute(diagonal) / 2);
    return most[0] > kMaxCurvature || most[1] > kMaxCurvature || most[2] > kMaxCurvature || most[3] > kMaxCurvature;
}

} // namespace

SampleSums::Columns SampleSums::Rows::lit_around() const {
    Columns all{width, 0};
    for (const Columns &row : lit)
        all = {std::min(all.first, row.first), std::max(all.end, row.end)};
    return {std::max(all.first - 1, 0), std::min(all.end + 1, width)};
}

SampleSums::Columns SampleSums::lit_columns(int y) const {
    const Float4 *const sums = sums_at(y);
    Columns lit{0, width_};
    while (lit.first < width_ && sums[lit.first][3] == 0)
        ++lit.first;
    while (lit.end > lit.first && sums[lit.end - 1][3] == 0)
        --lit.end;
    return lit;
}

// Square roots of the light in a row, background included, and alpha.
void SampleSums::look_at(int y, Float4 behind, Rows &to) const {
    const Float4 *const sums = sums_at(y);
    const auto root_of = [&](Float4 sum) {
        constexpr Float4 kBlack{}, kWhite{1, 1, 1, 1};
        const Float4 light = sum + behind * (1 - sum[3]), positive = light < kBlack ? kBlack : light,
                     clamped = positive > kWhite ? kWhite : positive;
        return Float4{std::sqrt(clamped[0]), std::sqrt(clamped[1]), std::sqrt(clamped[2]), sum[3]};
    };
    const Columns lit = to.lit[Rows::index(y)] = lit_columns(y);
    Float4 *const roots = to.pixels(y);
    std::fill_n(roots, lit.first, root_of(Float4{}));
    std::transform(sums + lit.first, sums + lit.end, roots + lit.first, root_of);
    std::fill(roots + lit.end, roots + width_, root_of(Float4{}));
    repeat_ends(to.rows[Rows::index(y)]);
}

void SampleSums::choose_row(const Rows &rows, int y) {
    const Float4 *const above = rows.pixels(y - 1), *const here = rows.pixels(y), *const below = rows.pixels(y + 1);
    const std::span<std::uint64_t> bits = chosen_.row(y);
    std::fill(bits.begin(), bits.end(), 0);
    Columns some = rows.lit_around();
    // The pixels beside them are alike.
    if ((some.first > 0 || some.end < width_) && is_curved(above, here, below, some.first > 0 ? 0 : width_ - 1))
        some = {0, width_};
    for (int x = some.first; x < some.end; ++x)
        if (is_curved(above, here, below, x))
            bits[static_cast<std::size_t>(x / PixelBits::kBits)] |= std::uint64_t{1} << (x % PixelBits::kBits);
    if (chooses_beside_) {
        widen(bits, 1);
        bits.back() &= bits_between(0, width_, static_cast<int>(bits.size() - 1) * PixelBits::kBits);
    }
}

void SampleSums::find_means(int y, int samples, Rows &to) const {
    const Columns lit = to.lit[Rows::index(y)] = lit_columns(y);
    const Float4 *const sums = sums_at(y);
    Float4 *const means = to.pixels(y);
    std::fill_n(means, lit.first, Float4{});
    std::copy(sums + lit.first, sums + lit.end, means + lit.first);
    std::fill(means + lit.end, means + width_, Float4{});
    if (has_choice())
        for_each_bit(chosen_.row(std::clamp(y, 0, height_ - 1)),
                     [&](int x) { means[x] /= static_cast<float>(samples); });
    repeat_ends(to.rows[Rows::index(y)]);
}

// The mean of a smooth function over a square of edge 1 is its value in the middle, and a 24th of its second
// derivatives' sum.
void SampleSums::smooth_row(const Rows &rows, int y, std::vector<Float4> &to) const {
    const Float4 *const above = rows.pixels(y - 1), *const here = rows.pixels(y), *const below = rows.pixels(y + 1);
    std::copy_n(here, width_, to.begin());
    if (!has_choice())
        return;
    const auto [first, end] = rows.lit_around();
    for (int x = first; x < end; ++x)
        to[static_cast<std::size_t>(x)] += (above[x] + below[x] + here[x - 1] + here[x + 1] - 4 * here[x]) / 24;
    for_each_bit(chosen_.row(y), [&](int x) { to[static_cast<std::size_t>(x)] = here[x]; });
}

} // namespace pbm
