#include "pbm_build/images/texture_pyramid.h"

#include "pbm_format/model/point_values.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace pbm::build {
namespace {

using Texel = TexturePyramid::Texel;

constexpr std::uint16_t kStep = 257; // 65,535 / 255

std::span<const std::uint16_t> plain_table() {
    static constexpr std::array<std::uint16_t, 256> kTable = [] {
        std::array<std::uint16_t, 256> table{};
        for (std::size_t i = 0; i < table.size(); ++i)
            table[i] = static_cast<std::uint16_t>(i * kStep);
        return table;
    }();
    return kTable;
}

// Numbers that are rounded up from level to level would drift.
std::uint8_t rounded_to_even(std::uint64_t sum, std::uint64_t weights) {
    const std::uint64_t whole = sum / weights, twice_rest = 2 * (sum % weights);
    const bool is_up = twice_rest > weights || (twice_rest == weights && whole % 2 == 1);
    return static_cast<std::uint8_t>(whole + (is_up ? 1 : 0));
}

// The mean of up to four texels, weighted by how much of them counts; that of all if nothing does.
Texel mean_of(std::span<const Texel> parts, std::size_t whole, const std::uint16_t *table) {
    const bool are_colours = table == linear_table().data();
    std::array<std::uint64_t, 3> sums{};
    std::uint64_t weights = 0, covered = 0;
    for (const Texel &part : parts)
        covered += part[3];
    for (const Texel &part : parts) {
        const std::uint64_t weight = covered == 0 ? 1 : part[3];
        weights += weight;
        for (std::size_t c = 0; c < 3; ++c)
            sums[c] += weight * table[part[c]];
    }
    Texel mean;
    for (std::size_t c = 0; c < 3; ++c)
        mean[c] = are_colours ? linear_to_srgb(static_cast<std::uint32_t>((2 * sums[c] + weights) / (2 * weights)))
                              : rounded_to_even(sums[c] / kStep, weights);
    // Rounded up, so that no covered texel is lost.
    mean[3] = static_cast<std::uint8_t>((covered + whole - 1) / whole);
    return mean;
}

TexturePyramid::Level half_of(const TexturePyramid::Level &level, const std::uint16_t *table, int threads) {
    TexturePyramid::Level half{(level.width + 1) / 2, (level.height + 1) / 2, {}, {}};
    half.texels.resize(std::size_t{half.width} * half.height);
    half.cut.resize(level.cut.empty() ? 0 : half.texels.size());
    parallel_for(half.height, threads, [&](std::size_t y) {
        const std::size_t rows = 2 * y + 1 < level.height ? 2 : 1;
        for (std::size_t x = 0; x < half.width; ++x) {
            const std::size_t columns = 2 * x + 1 < level.width ? 2 : 1;
            std::array<Texel, 4> parts{};
            std::size_t count = 0, cut = 0;
            for (std::size_t row = 0; row < rows; ++row)
                for (std::size_t column = 0; column < columns; ++column) {
                    const std::size_t from = (2 * y + row) * level.width + 2 * x + column;
                    parts[count++] = level.texels[from];
                    cut += level.cut.empty() ? 0U : level.cut[from];
                }
            half.texels[y * half.width + x] = mean_of(std::span(parts).first(count), count, table);
            if (!level.cut.empty())
                half.cut[y * half.width + x] = static_cast<std::uint8_t>(cut / count);
        }
    });
    return half;
}

} // namespace

// Marks texels `first`..`last` of a period of the row, and joins them to the span of the row that is known.
void TextureCoverage::mark_part(std::uint32_t row, std::uint32_t first, std::uint32_t last, std::uint32_t period) {
    const auto from = [](std::uint64_t span) { return static_cast<std::uint32_t>(span >> 32); };
    const auto end = [](std::uint64_t span) { return static_cast<std::uint32_t>(span); };
    std::atomic_ref span(spans_[row]);
    std::uint64_t known = span.load(std::memory_order_relaxed);
    if (from(known) <= first && last < end(known))
        return;
    for (std::uint32_t x = first; x <= last; ++x)
        std::atomic_ref(covered_[std::size_t{row} * width_ + wrapped(x, width_, wrap_[0])])
            .store(1, std::memory_order_relaxed);
    for (;;) {
        std::uint32_t joined_from = first, joined_end = last + 1;
        if (first <= end(known) && from(known) <= last + 1 && known != 0) {
            joined_from = std::min(first, from(known));
            joined_end = std::max(last + 1, end(known));
        } else if (end(known) - from(known) >= last + 1 - first) {
            return; // the longer one is kept
        }
        const std::uint64_t joined = std::uint64_t{joined_from} << 32 | joined_end;
        if (joined == known)
            return;
        if (!span.compare_exchange_weak(known, joined, std::memory_order_relaxed))
            continue;
        if (joined_from == 0 && joined_end == period)
            std::atomic_ref(full_rows_).fetch_add(1, std::memory_order_relaxed);
        return;
    }
}

void TextureCoverage::mark(std::int64_t x0, std::int64_t x1, std::int64_t y) {
    const std::uint32_t row = wrapped(y, height_, wrap_[1]);
    const std::uint32_t period = wrap_[0] == Wrap::mirror ? 2 * width_ : width_;
    const auto last = std::int64_t{period} - 1;
    if (wrap_[0] == Wrap::clamp) {
        x0 = std::clamp<std::int64_t>(x0, 0, last);
        x1 = std::clamp<std::int64_t>(x1, 0, last);
    } else {
        const std::int64_t length = std::min(x1 - x0, last);
        x0 = (x0 % period + period) % period;
        x1 = x0 + length;
    }
    const auto part = [&](std::int64_t from, std::int64_t to) {
        mark_part(row, static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to), period);
    };
    part(x0, std::min(x1, last));
    if (x1 > last)
        part(0, x1 - period);
}

void TextureCoverage::add(const TextureCorners &corners) {
    if (std::atomic_ref(full_rows_).load(std::memory_order_relaxed) == height_)
        return;
    std::array<glm::dvec2, 3> at;
    glm::dvec2 low(1e18), high(-1e18);
    for (std::size_t i = 0; i < 3; ++i) {
        at[i] = glm::dvec2(corners[i]) * glm::dvec2(width_, height_);
        if (!(std::abs(at[i].x) < 1e9 && std::abs(at[i].y) < 1e9))
            return; // no place
        low = glm::min(low, at[i]);
        high = glm::max(high, at[i]);
    }
    constexpr double kAround = 0.5, kFar = 1e18;
    double first_row = std::floor(low.y - kAround), last_row = high.y + kAround;
    const bool ends = wrap_[1] == Wrap::clamp; // its first and last row go on
    if (ends) {
        first_row = std::clamp(first_row, -1.0, static_cast<double>(height_));
        last_row = std::clamp(last_row, -1.0, static_cast<double>(height_));
    } else if (last_row - first_row > 2.0 * height_) { // an image that is repeated so often is covered as a whole
        for (std::int64_t row = 0; row < height_; ++row)
            mark(0, 2 * std::int64_t{width_}, row);
        return;
    }
    for (double y = first_row; y <= last_row; y += 1) {
        // The part of the triangle within this row and half a texel around it.
        const double from = ends && y < 0 ? -kFar : y - kAround, to = ends && y >= height_ ? kFar : y + 1 + kAround;
        double left = 1e18, right = -1e18;
        for (std::size_t i = 0; i < 3; ++i) {
            const glm::dvec2 a = at[i], b = at[(i + 1) % 3];
            if (std::max(a.y, b.y) < from || std::min(a.y, b.y) > to)
                continue;
            const double height = b.y - a.y;
            for (const double edge : {from, to}) {
                const double t = height == 0 ? 0 : std::clamp((edge - a.y) / height, 0.0, 1.0);
                const double x = a.x + t * (b.x - a.x);
                left = std::min(left, x);
                right = std::max(right, x);
            }
            if (height == 0) {
                left = std::min(left, b.x);
                right = std::max(right, b.x);
            }
        }
        if (left <= right)
            mark(static_cast<std::int64_t>(std::floor(left - kAround)),
                 static_cast<std::int64_t>(std::floor(right + kAround)), static_cast<std::int64_t>(y));
    }
}

TexturePyramid::TexturePyramid(Texture texture, const TextureCoverage &coverage, int threads)
    : use_(texture.use), table_((are_colours(use_.content) ? linear_table() : plain_table()).data()) {
    levels_.push_back({texture.width, texture.height, std::move(texture.texels), {}});
    std::vector<Texel> &texels = levels_.front().texels;
    std::vector<std::uint8_t> &cut = levels_.front().cut;
    cut.resize(use_.least_opacity > 0 ? texels.size() : 0);
    for (std::size_t i = 0; i < texels.size(); ++i) {
        const std::uint8_t opacity = texels[i][3];
        const auto shown = is_faded() ? static_cast<std::uint8_t>(static_cast<float>(opacity) * use_.opacity + 0.5F)
                                      : static_cast<std::uint8_t>(use_.is_hole(opacity) ? 0 : 255);
        texels[i][3] = coverage.covers(i) ? shown : std::uint8_t{0};
        if (!cut.empty())
            cut[i] = coverage.covers(i) ? static_cast<std::uint8_t>(255 - shown) : std::uint8_t{0};
    }
    while (levels_.back().width > 1 || levels_.back().height > 1) {
        Level half = half_of(levels_.back(), table_, threads);
        levels_.push_back(std::move(half));
    }
}

std::vector<TextureCoverage> covered_texels(const Surface &surface, int threads) {
    std::vector<TextureCoverage> coverages(surface.textures.begin(), surface.textures.end());
    constexpr std::size_t kBlock = 4096;
    const auto add = [&](const std::vector<std::uint16_t> &ids, const std::vector<TextureCorners> &corners) {
        parallel_for(ids.size(), kBlock, threads, [&](std::size_t i) {
            if (ids[i] != Surface::kNoTexture)
                coverages[ids[i]].add(corners[i]);
        });
    };
    add(surface.texture_ids, surface.texture_corners);
    for (const ImageLayer &layer : surface.layers)
        add(layer.ids, layer.corners);
    return coverages;
}

std::vector<TexturePyramid> make_pyramids(Surface &surface, int threads) {
    const std::vector<TextureCoverage> coverages = covered_texels(surface, threads);
    std::vector<TexturePyramid> pyramids;
    for (std::size_t i = 0; i < surface.textures.size(); ++i)
        pyramids.emplace_back(std::move(surface.textures[i]), coverages[i], threads);
    surface.textures.clear();
    return pyramids;
}

} // namespace pbm::build
