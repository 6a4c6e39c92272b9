#include "pbm_render/surroundings/panorama_sampler.h"

#include "pbm_render/camera/camera.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/surroundings/panorama_sampler.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/surroundings/texel_filter.h"

#ifndef PBM_RENDER_PANORAMA_BLOCKS
#define PBM_RENDER_PANORAMA_BLOCKS
namespace pbm {

// Blocks whose places are computed at once.
inline constexpr std::size_t kBlocks = 64;

// Places on the panorama, in units of its width and height, at the first ray of each block and behind the last one.
struct BlockPlaces {
    std::array<float, kBlocks + kLaneNumbers.size() + 1> u, v;
    std::array<float, kBlocks + kLaneNumbers.size() + 1> squared_length; // of the ray
    std::array<float, kBlocks + kLaneNumbers.size() + 1> squared_cosine; // of the latitude
};

// Makes the texels ready that a block needs; most blocks need one tile.
class ReadyTexels {
  public:
    ReadyTexels(const TexelLevels &texels, int level) : texels_(&texels), number_(level) {}

    const TexelLevel &level() const { return level_; }
    // Requires the texels around all places between (u0, v0) and (u1, v1); u outside 0..1 lies beyond the seam.
    void require(float u0, float v0, float u1, float v1) {
        const int width = 1 << (texels_->width_bits() - number_);
        const auto columns = static_cast<float>(width), rows = static_cast<float>(std::max(1, width / 2));
        const int left = floor_of(std::min(u0, u1) * columns - 0.5F),
                  right = floor_of(std::max(u0, u1) * columns - 0.5F);
        const int last = static_cast<int>(rows) - 1;
        const int top = std::clamp(floor_of(std::min(v0, v1) * rows - 0.5F), 0, last);
        const int bottom = std::clamp(floor_of(std::max(v0, v1) * rows - 0.5F) + 1, 0, last);
        // One more column on either side, since the places between are rounded.
        const int first = right - left + 4 >= width ? 0 : (left - 1) & (width - 1);
        const int end = right - left + 4 >= width ? width - 1 : (right + 2) & (width - 1);
        if (first <= end) {
            require_columns(first, end, std::max(0, top - 1), bottom);
        } else {
            require_columns(0, end, std::max(0, top - 1), bottom);
            require_columns(first, width - 1, std::max(0, top - 1), bottom);
        }
    }

  private:
    static int floor_of(float x) { return static_cast<int>(std::floor(x)); }
    void require_columns(int first, int last, int top, int bottom) {
        const std::array<int, 4> tiles{first / kTile, last / kTile, top / kTile, bottom / kTile};
        if (tiles == tiles_)
            return;
        tiles_ = tiles;
        level_ = texels_->require(number_, first, top, last, bottom);
    }

    static constexpr int kTile = static_cast<int>(kTileEdge);
    const TexelLevels *texels_;
    int number_;
    TexelLevel level_;
    std::array<int, 4> tiles_{-1, -1, -1, -1};
};

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// atan(smaller / larger) in turns, both >= 0; wrong by less than 5e-7 radians.
HWY_INLINE Vector turns_below_diagonal(Vector smaller, Vector larger) {
    const Floats d;
    const Vector ratio = hn::Div(smaller, hn::Max(larger, hn::Set(d, 1e-30F)));
    const Vector square = hn::Mul(ratio, ratio);
    Vector sum = hn::Set(d, 0.00121727333F);
    for (const float term : {-0.0057869423F, 0.0132299859F, -0.0214029404F, 0.0316273344F, -0.0530394639F, 0.15915482F})
        sum = hn::Add(hn::Mul(sum, square), hn::Set(d, term));
    return hn::Mul(sum, ratio);
}

// Angle of (x, y) from the x axis, in turns, y >= 0, x of any sign if `behind`.
HWY_INLINE Vector turns(Vector y, Vector x, bool behind) {
    const Floats d;
    const Vector ahead = hn::Abs(x);
    const Vector small = turns_below_diagonal(hn::Min(ahead, y), hn::Max(ahead, y));
    const Vector angle = hn::IfThenElse(hn::Gt(y, ahead), hn::Sub(hn::Set(d, 0.25F), small), small);
    return behind ? hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Sub(hn::Set(d, 0.5F), angle), angle) : angle;
}

struct PanoramaPosition {
    Vector u, v, squared_length, squared_cosine;
};

HWY_INLINE PanoramaPosition position_of(Vector right, Vector up, Vector forward) {
    const Floats d;
    const Vector half = hn::Set(d, 0.5F);
    const Vector level = hn::Add(hn::Mul(right, right), hn::Mul(forward, forward));
    const Vector longitude = turns(hn::Abs(right), forward, true);
    const Vector latitude = turns(hn::Abs(up), hn::Sqrt(level), false);
    const Vector length = hn::Add(level, hn::Mul(up, up));
    return {hn::Add(half, hn::CopySign(longitude, right)), hn::Sub(half, hn::CopySign(hn::Add(latitude, latitude), up)),
            length, hn::Div(level, hn::Max(length, hn::Set(d, 1e-30F)))};
}

// Rays in the axes of the panorama.
struct Rays {
    glm::vec3 first, step;
    HWY_INLINE PanoramaPosition at(Vector x) const {
        const Floats d;
        const auto component = [&](int i) { return hn::Add(hn::Set(d, first[i]), hn::Mul(x, hn::Set(d, step[i]))); };
        return position_of(component(0), component(1), component(2));
    }
};

void find_places(const Rays &rays, std::size_t first_block, BlockPlaces &places) {
    const Floats d;
    const std::size_t lanes = hn::Lanes(d);
    const Vector block = hn::Set(d, static_cast<float>(kRayBlock));
    for (std::size_t i = 0; i <= kBlocks; i += lanes) {
        const Vector number = hn::Add(lane_numbers(), hn::Set(d, static_cast<float>(first_block + i)));
        const PanoramaPosition place = rays.at(hn::Mul(number, block));
        hn::StoreU(place.u, d, places.u.data() + i);
        hn::StoreU(place.v, d, places.v.data() + i);
        hn::StoreU(place.squared_length, d, places.squared_length.data() + i);
        hn::StoreU(place.squared_cosine, d, places.squared_cosine.data() + i);
    }
}

// The places where the rays of a block meet the panorama: on a straight line between those of its ends unless the
// block bends too much.
struct Block {
    std::size_t x;          // of the first ray
    float u, v, to_u, to_v; // at x and x + kRayBlock
    bool straight;
    HWY_INLINE std::pair<Vector, Vector> places(const Rays &rays, std::size_t at) const {
        const Floats d;
        if (!straight) {
            const PanoramaPosition place = rays.at(hn::Add(lane_numbers(), hn::Set(d, static_cast<float>(x + at))));
            return {place.u, place.v};
        }
        constexpr float kStep = 1.0F / kRayBlock;
        const Vector t = hn::Mul(hn::Add(lane_numbers(), hn::Set(d, static_cast<float>(at))), hn::Set(d, kStep));
        return {hn::Add(hn::Set(d, u), hn::Mul(t, hn::Set(d, to_u - u))),
                hn::Add(hn::Set(d, v), hn::Mul(t, hn::Set(d, to_v - v)))};
    }
};

// Requires the texels of a block that bends.
void require_bent(const Block &block, const Rays &rays, ReadyTexels &texels) {
    const Floats d;
    std::array<float, kRayBlock + kLaneNumbers.size()> u{}, v{};
    for (std::size_t at = 0; at < kRayBlock; at += hn::Lanes(d)) {
        const auto [us, vs] = block.places(rays, at);
        hn::StoreU(us, d, u.data() + at);
        hn::StoreU(vs, d, v.data() + at);
    }
    for (std::size_t i = 0; i < kRayBlock; ++i)
        texels.require(u[i], v[i], u[i], v[i]);
}

// Two mip levels and the weight of the coarser one; where that is 0, the coarser level is not read.
struct MipPair {
    const TexelLevel &finer, &coarser;
    float fraction;
};

#if HWY_TARGET != HWY_SCALAR
// The colours of a block from texels that fit two vectors, one below the other: they are unpacked once for all pixels.
// Each number is computed as Corners computes it.
class CloseTexels {
  public:
    // Whether the texels around all pixels of the block are those of two such vectors, within one tile.
    HWY_INLINE bool hold(const TexelLevel &level, const Block &block, const Rays &rays) {
        const Floats d;
        const Ints di;
        const Vector half = hn::Set(d, 0.5F);
        const auto columns = static_cast<float>(level.width()), rows = static_cast<float>(level.height());
        constexpr int kTileMask = static_cast<int>(kTileEdge) - 1;
        const int last_x = level.width() - 1, last_y = level.height() - 1;
        const auto lanes = static_cast<std::int32_t>(hn::Lanes(d));
        const auto some_x = static_cast<std::int32_t>(std::floor(std::min(block.u, block.to_u) * columns - 0.5F));
        const auto some_y =
            static_cast<std::int32_t>(std::clamp(block.v * rows - 0.5F, 0.0F, static_cast<float>(last_y)));
        const std::int32_t first = std::min(some_x, std::min(some_x | kTileMask, last_x) - (lanes - 1));
        if (first < 0)
            return false;
        const IntVector row = hn::Set(di, some_y), none = hn::Set(di, -lanes), one = hn::Set(di, 1);
        IntVector beyond = hn::Zero(di);
        for (std::size_t i = 0; i < kVectors; ++i) {
            const auto [u, v] = block.places(rays, i * hn::Lanes(d));
            const Vector x = hn::Sub(hn::Mul(u, hn::Set(d, columns)), half);
            const Vector y = hn::Min(hn::Max(hn::Sub(hn::Mul(v, hn::Set(d, rows)), half), hn::Zero(d)),
                                     hn::Set(d, static_cast<float>(last_y)));
            const Vector left = hn::Floor(x), top = hn::Floor(y);
            across_[i] = hn::Sub(x, left);
            down_[i] = hn::Sub(y, top);
            columns_[i] = hn::Sub(hn::ConvertTo(di, left), hn::Set(di, first));
            const IntVector outside = hn::And(hn::Or(columns_[i], hn::Add(columns_[i], one)), none);
            beyond = hn::Or(beyond, hn::Or(outside, hn::Xor(hn::ConvertTo(di, top), row)));
        }
        if (!hn::AllTrue(di, hn::Eq(beyond, hn::Zero(di))))
            return false;
        const auto *const texels = reinterpret_cast<const std::int32_t *>(level.texels) + first;
        above_ = hn::LoadU(di, texels + (std::int64_t{some_y} << level.width_bits));
        below_ = hn::LoadU(di, texels + (std::int64_t{std::min(some_y + 1, last_y)} << level.width_bits));
        return true;
    }

    template <int kShift> HWY_INLINE void write(float *to) const {
        const Floats d;
        const auto next =
            hn::IndicesFromVec(d, hn::Min(hn::Add(hn::LoadU(Ints(), kLaneNumbers.data()), hn::Set(Ints(), 1)),
                                          hn::Set(Ints(), static_cast<std::int32_t>(hn::Lanes(d)) - 1)));
        const Vector upper = unpacked<kShift>(above_), lower = unpacked<kShift>(below_);
        const Vector upper_step = hn::Sub(hn::TableLookupLanes(upper, next), upper),
                     lower_step = hn::Sub(hn::TableLookupLanes(lower, next), lower);
        const Vector scale = hn::Set(d, 1 / (kRootSteps * kRootSteps));
        for (std::size_t i = 0; i < kVectors; ++i) {
            const auto at = hn::IndicesFromVec(d, columns_[i]);
            const auto along = [&](Vector from, Vector step) {
                return hn::Add(hn::TableLookupLanes(from, at), hn::Mul(across_[i], hn::TableLookupLanes(step, at)));
            };
            const Vector top = along(upper, upper_step), bottom = along(lower, lower_step);
            const Vector colour = hn::Add(top, hn::Mul(down_[i], hn::Sub(bottom, top)));
            hn::StoreU(hn::Mul(scale, colour), d, to + i * hn::Lanes(d));
        }
    }

  private:
    static constexpr std::size_t kVectors = kRayBlock / hn::MaxLanes(Floats());

    template <int kShift> static HWY_INLINE Vector unpacked(IntVector texels) {
        const IntVector bits = hn::And(hn::ShiftRight<kShift>(texels), hn::Set(Ints(), 1023));
        const Vector root = hn::ConvertTo(Floats(), bits);
        return hn::Mul(root, root);
    }

    std::array<Vector, kVectors> across_, down_;
    std::array<IntVector, kVectors> columns_; // of the left texels, in the two vectors
    IntVector above_, below_;
};
#endif

void filter_block(const Block &block, const Rays &rays, const MipPair &mips, const LinearRow &row) {
    const auto &[finer, coarser, fraction] = mips;
    const auto [red, green, blue] = row;
    const Floats d;
#if HWY_TARGET != HWY_SCALAR
    // Where the picture is finer than the panorama, a block sees few texels.
    if (CloseTexels texels; fraction == 0 && texels.hold(finer, block, rays)) {
        texels.write<0>(red + block.x);
        texels.write<10>(green + block.x);
        texels.write<20>(blue + block.x);
        return;
    }
#endif
    for (std::size_t at = 0; at < kRayBlock; at += hn::Lanes(d)) {
        const auto [u, v] = block.places(rays, at);
        Colours colours = Corners(finer, u, v, true).colours();
        if (fraction > 0)
            colours = mix(colours, Corners(coarser, u, v, true).colours(), hn::Set(d, fraction));
        hn::StoreU(colours.red, d, red + block.x + at);
        hn::StoreU(colours.green, d, green + block.x + at);
        hn::StoreU(colours.blue, d, blue + block.x + at);
    }
}

void sample_row(const TexelLevels &texels, const RayRow &row, float pixel_texels, const std::uint8_t *wanted,
                const LinearRow &to) {
    // Within a block a great circle leaves the straight line by less than a sixth of a pixel below this latitude.
    constexpr float kMinSquaredCosine = 0.25F, kLongestStep = 1.0F / 16;
    const Rays rays{row.first, row.step};
    const bool narrow = static_cast<float>(kRayBlock) * glm::length(row.step) < kLongestStep;
    const int last_level = texels.levels() - 1;
    std::vector<ReadyTexels> ready;
    for (int level = 0; level <= last_level; ++level)
        ready.emplace_back(texels, level);
    BlockPlaces places;
    std::size_t placed = 0; // blocks before this one have places, if they are among the last kBlocks
    const std::size_t blocks = (row.count + kRayBlock - 1) / kRayBlock;
    for (std::size_t i = 0; i < blocks; ++i) {
        if (wanted[i] == 0)
            continue;
        const std::size_t at = i % kBlocks;
        if (i >= placed) {
            find_places(rays, i - at, places);
            placed = i - at + kBlocks;
        }
        Block block{i * kRayBlock, places.u[at], places.v[at], places.u[at + 1], places.v[at + 1], narrow};
        block.to_u -= std::round(block.to_u - block.u); // the short way round
        block.straight &= std::min(places.squared_cosine[at], places.squared_cosine[at + 1]) > kMinSquaredCosine;
        // A pixel's solid angle shrinks with the cube of the cosine between its ray and the middle one.
        float level = 0;
        if (pixel_texels > 1)
            level = std::clamp(std::log2(pixel_texels) - 0.75F * std::log2(places.squared_length[at]), 0.0F,
                               static_cast<float>(last_level));
        const int number = static_cast<int>(level);
        const float fraction = level - static_cast<float>(number);
        ReadyTexels &finer = ready[static_cast<std::size_t>(number)];
        ReadyTexels &coarser = ready[static_cast<std::size_t>(std::min(number + 1, last_level))];
        for (ReadyTexels *const one : {&finer, &coarser}) {
            if (block.straight)
                one->require(block.u, block.v, block.to_u, block.to_v);
            else
                require_bent(block, rays, *one);
            if (fraction == 0)
                break;
        }
        filter_block(block, rays, {finer.level(), coarser.level(), fraction}, to);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {
namespace {

Float4 bilinear(const TexelLevels &texels, int number, float u, float v) {
    const int width = 1 << (texels.width_bits() - number), height = std::max(1, width / 2);
    const float x = u * static_cast<float>(width) - 0.5F;
    const float y = std::clamp(v * static_cast<float>(height) - 0.5F, 0.0F, static_cast<float>(height - 1));
    const float left = std::floor(x), top = std::floor(y);
    const int x0 = static_cast<int>(left) & (width - 1), x1 = (static_cast<int>(left) + 1) & (width - 1);
    const int y0 = static_cast<int>(top), y1 = std::min(y0 + 1, height - 1);
    const auto texel = [&](int column, int row) {
        const TexelLevel level = texels.require(number, column, row, column, row);
        return unpack_roots(level.texels[(row << level.width_bits) + column]);
    };
    const auto along = [&](int row) {
        const Float4 a = texel(x0, row);
        return a + (x - left) * (texel(x1, row) - a);
    };
    const Float4 upper = along(y0);
    return upper + (y - top) * (along(y1) - upper);
}

} // namespace

HWY_EXPORT(sample_row);

PanoramaSampler::PanoramaSampler(std::shared_ptr<const TiledImage> panorama, UpAxis up)
    : texels_({std::move(panorama)}, 128) {
    const glm::dvec3 y = up_direction(up), forward = -front_direction(up);
    const glm::dvec3 right = glm::cross(forward, y);
    axes_ = glm::mat3(glm::transpose(glm::dmat3(right, y, forward)));
}

Float4 PanoramaSampler::sample(glm::vec3 direction, float footprint) const {
    constexpr float kTurn = 2 * std::numbers::pi_v<float>;
    const glm::vec3 d = axes_ * direction;
    const float u = 0.5F + std::atan2(d.x, d.z) / kTurn;
    const float v = 0.5F - 2 * std::atan2(d.y, std::hypot(d.x, d.z)) / kTurn;
    const float texels = footprint * static_cast<float>(1 << texels_.width_bits()) / kTurn;
    const int last = texels_.levels() - 1;
    const float level = texels > 1 ? std::min(std::log2(texels), static_cast<float>(last)) : 0.0F;
    const int number = static_cast<int>(level);
    const Float4 finer = bilinear(texels_, number, u, v);
    const float fraction = level - static_cast<float>(number);
    return fraction > 0 ? finer + fraction * (bilinear(texels_, number + 1, u, v) - finer) : finer;
}

void PanoramaSampler::sample_row(const RayRow &rays, const std::uint8_t *wanted, const LinearRow &to) const {
    const float texels_of_turn = static_cast<float>(1 << texels_.width_bits());
    const float pixel_texels = rays.pixel_angle * texels_of_turn / (2 * std::numbers::pi_v<float>);
    RayRow row = rays; // in the panorama's axes
    row.first = axes_ * rays.first;
    row.step = axes_ * rays.step;
    HWY_DYNAMIC_DISPATCH(sample_row)(texels_, row, pixel_texels, wanted, to);
}

} // namespace pbm
#endif // HWY_ONCE
