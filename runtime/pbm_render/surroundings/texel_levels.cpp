#include "pbm_render/surroundings/texel_levels.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <utility>

namespace pbm {
namespace {

constexpr int kCellBits = 3;
constexpr std::uint32_t kCellEdge = 1 << kCellBits;      // texels
constexpr std::uint64_t kManyValues = ~std::uint64_t{0}; // or not ready

std::uint32_t root_of(std::uint8_t srgb) {
    return static_cast<std::uint32_t>(std::lround(std::sqrt(linear_table()[srgb] / 65535.0) * kRootSteps));
}

} // namespace

std::uint32_t pack_roots(Rgb8 srgb) { return root_of(srgb[0]) | root_of(srgb[1]) << 10 | root_of(srgb[2]) << 20; }

Float4 unpack_roots(std::uint32_t texel) {
    const Float4 roots{static_cast<float>(texel & 1023), static_cast<float>(texel >> 10 & 1023),
                       static_cast<float>(texel >> 20), 0};
    return roots * roots * (1 / (kRootSteps * kRootSteps));
}

TexelLevels::TexelLevels(std::vector<std::shared_ptr<const TiledImage>> images, std::uint8_t missing)
    : images_(std::move(images)), missing_{missing, missing, missing},
      levels_(static_cast<std::size_t>(images_.front()->levels())) {
    const TiledImage &first = *images_.front();
    assert(images_.size() <= (first.channels() == 1 ? 4U : 1U));
    assert(std::all_of(images_.begin(), images_.end(), [&](const auto &image) {
        return image->width() == first.width() && image->height() == first.height();
    }));
    width_bits_ = std::countr_zero(first.width());
    height_bits_ = std::countr_zero(first.height());
    for (std::size_t i = 0; i < roots_.size(); ++i)
        roots_[i] = root_of(static_cast<std::uint8_t>(i));
}

// Memory that no tile writes to is never touched.
std::uint32_t *TexelLevels::begin(Level &level, int number) const {
    std::call_once(level.begun, [&] {
        const TileGrid &grid = images_.front()->grid();
        level.is_ready =
            std::make_unique<std::atomic<bool>[]>(std::size_t{grid.tiles_across(number)} * grid.tiles_down(number));
        level.texels.resize(std::size_t{grid.width(number)} * grid.height(number));
        if (images_.front()->channels() == 1 && std::min(grid.width(number), grid.height(number)) >= kCellEdge) {
            const std::size_t cells = level.texels.size() >> 2 * kCellBits;
            level.cells = std::make_unique<std::atomic<std::uint64_t>[]>(cells);
            std::fill_n(level.cells.get(), cells, kManyValues);
        }
    });
    return level.texels.data();
}

TexelLevel TexelLevels::require(int number, int first_x, int first_y, int last_x, int last_y) const {
    Level &level = levels_[static_cast<std::size_t>(number)];
    const TexelLevel result{begin(level, number), std::max(0, width_bits_ - number),
                            std::max(0, height_bits_ - number)};
    assert(first_x >= 0 && last_x < result.width() && first_y >= 0 && last_y < result.height());
    constexpr int kTileBits = std::countr_zero(kTileEdge);
    const std::uint32_t across = images_.front()->grid().tiles_across(number);
    for (int ty = first_y >> kTileBits; ty <= last_y >> kTileBits; ++ty)
        for (int tx = first_x >> kTileBits; tx <= last_x >> kTileBits; ++tx) {
            const auto x = static_cast<std::uint32_t>(tx), y = static_cast<std::uint32_t>(ty);
            if (!level.is_ready[std::size_t{y} * across + x].load(std::memory_order_acquire))
                make_ready(level, number, x, y);
        }
    return result;
}

void TexelLevels::make_ready(Level &level, int number, std::uint32_t tx, std::uint32_t ty) const {
    const TileGrid &grid = images_.front()->grid();
    const std::size_t tile = std::size_t{ty} * grid.tiles_across(number) + tx;
    const std::lock_guard lock(mutexes_[tile % mutexes_.size()]);
    if (level.is_ready[tile].load(std::memory_order_relaxed))
        return;
    const std::uint32_t width = grid.tile_width(number), height = grid.tile_height(number);
    bool is_patched = false;
    for (std::size_t channel = 0; channel < images_.size(); ++channel) {
        const TiledImage &image = *images_[channel];
        const std::uint8_t *texels = image.tile(number, tx, ty);
        Bytes patched;
        if (texels == nullptr) {
            is_patched = true;
            for (std::uint32_t y = 0; y < height; ++y)
                for (std::uint32_t x = 0; x < width; ++x) {
                    const std::uint8_t *const texel = coarser_texel(image, number, tx * width + x, ty * height + y);
                    patched.insert(patched.end(), texel, texel + image.channels());
                }
            texels = patched.data();
        }
        for (std::uint32_t y = 0; y < height; ++y)
            convert_row(
                image, texels + std::size_t{y} * width * image.channels(), width, static_cast<unsigned>(8 * channel),
                level.texels.data() + (std::size_t{ty} * height + y) * grid.width(number) + std::size_t{tx} * width);
    }
    if (level.cells != nullptr && !is_patched)
        find_cells(level, number, tx, ty);
    level.is_ready[tile].store(true, std::memory_order_release);
    if (is_patched) {
        const std::lock_guard patched_lock(patched_mutex_);
        patched_.push_back(&level.is_ready[tile]);
    }
}

void TexelLevels::find_cells(Level &level, int number, std::uint32_t tx, std::uint32_t ty) const {
    const TileGrid &grid = images_.front()->grid();
    const std::uint32_t width = grid.width(number), cells_across = width >> kCellBits;
    const std::uint32_t across = grid.tile_width(number) >> kCellBits, down = grid.tile_height(number) >> kCellBits;
    for (std::uint32_t y = ty * down; y < (ty + 1) * down; ++y)
        for (std::uint32_t x = tx * across; x < (tx + 1) * across; ++x) {
            const std::uint32_t *const texels =
                level.texels.data() + std::size_t{y} * kCellEdge * width + x * kCellEdge;
            std::uint32_t other = 0; // bits in which texels differ from the first
            for (std::uint32_t i = 0; i < kCellEdge * kCellEdge; ++i)
                other |= texels[i / kCellEdge * width + i % kCellEdge] ^ texels[0];
            if (other == 0)
                level.cells[std::size_t{y} * cells_across + x].store(texels[0], std::memory_order_relaxed);
        }
}

std::optional<std::uint32_t> TexelLevels::only_value(int number, int first_x, int first_y, int last_x,
                                                     int last_y) const {
    Level &level = levels_[static_cast<std::size_t>(number)];
    begin(level, number);
    if (level.cells == nullptr)
        return std::nullopt;
    const int across_bits = width_bits_ - number - kCellBits;
    const auto cell = [&](int x, int y) {
        const std::size_t row = static_cast<std::size_t>(y) << across_bits;
        return level.cells[row + static_cast<std::size_t>(x)].load(std::memory_order_relaxed);
    };
    const std::uint64_t value = cell(first_x >> kCellBits, first_y >> kCellBits);
    for (int y = first_y >> kCellBits; y <= last_y >> kCellBits; ++y)
        for (int x = first_x >> kCellBits; x <= last_x >> kCellBits; ++x)
            if (cell(x, y) != value)
                return std::nullopt;
    return value == kManyValues ? std::nullopt : std::optional(static_cast<std::uint32_t>(value));
}

void TexelLevels::retry() const {
    const std::lock_guard lock(patched_mutex_);
    for (std::atomic<bool> *const is_ready : std::exchange(patched_, {}))
        is_ready->store(false, std::memory_order_release);
}

// In the place of a texel whose tile is damaged or not there yet: what the next coarser level has there.
const std::uint8_t *TexelLevels::coarser_texel(const TiledImage &image, int level, std::uint32_t x,
                                               std::uint32_t y) const {
    for (int coarser = level + 1; coarser < image.levels(); ++coarser) {
        const int steps = coarser - level;
        if (const std::uint8_t *const texel = image.texel(coarser, x >> steps, y >> steps))
            return texel;
    }
    return missing_.data();
}

void TexelLevels::convert_row(const TiledImage &image, const std::uint8_t *from, std::size_t count, unsigned shift,
                              std::uint32_t *to) const {
    if (image.channels() == 3) {
        for (std::size_t i = 0; i < count; ++i, from += 3)
            to[i] = roots_[from[0]] | roots_[from[1]] << 10 | roots_[from[2]] << 20;
    } else if (shift == 0) {
        for (std::size_t i = 0; i < count; ++i)
            to[i] = from[i];
    } else {
        for (std::size_t i = 0; i < count; ++i)
            to[i] |= std::uint32_t{from[i]} << shift;
    }
}

} // namespace pbm
