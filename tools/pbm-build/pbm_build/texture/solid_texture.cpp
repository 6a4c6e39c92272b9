#include "pbm_build/texture/solid_texture.h"

#include "pbm_build/texture/colour_map.h"
#include "pbm_build/texture/noise.h"
#include "pbm_scan/surface/refusal.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

// Samples are computed in blocks whose arrays stay in the cache of one core.
constexpr std::size_t kBlock = 512;
using Row = std::array<float, kBlock>;

// Coordinates in texture space; for wood, in the frame of the log.
struct Block {
    std::size_t size = 0;
    Row u, v, up;
    Row tone; // added to the value of wood
};

// What all samples of an evaluation have in common.
struct Recipe {
    PerlinNoise noise;
    float scale;
    float turbulence;
    double samples_per_unit; // of texture space
};

// Clamps coordinates so that cells of the finest octave fit 31 bits.
constexpr float kFarthest = 131072;

// Faster than std::floor, which is a function call without SSE4.
float whole_part(float value) {
    const auto cut = static_cast<float>(static_cast<std::int32_t>(value));
    return cut > value ? cut - 1 : cut;
}
std::uint8_t quantise(float value) { return static_cast<std::uint8_t>(clamped(value, 0, 1) * 255 + 0.5F); }

// Octaves at (u, v, up) x frequency + shift.
struct Layer {
    float u, v, up; // frequencies
    float shift;
    int octaves; // at most
    float gain;
};
void sum_octaves(const Recipe &recipe, const Block &block, const Layer &layer, Row &sums) {
    Row x, y, z;
    for (std::size_t i = 0; i < block.size; ++i) {
        x[i] = block.u[i] * layer.u + layer.shift;
        y[i] = block.v[i] * layer.v + layer.shift;
        z[i] = block.up[i] * layer.up + layer.shift;
    }
    const double finest = static_cast<double>(std::max({layer.u, layer.v, layer.up}));
    const Octaves octaves = band_limited_octaves(recipe.samples_per_unit / finest, layer.octaves, layer.gain);
    const auto part = [&block](auto &row) { return std::span(row.data(), block.size); };
    build::sum_octaves(recipe.noise, octaves, {part(x), part(y), part(z)}, part(sums));
}

// Darkness at `distance` from the middle of a vein: a sharp core with a wide, faint halo. A vein narrower than
// `narrowest` is drawn paler instead of narrower.
float vein(float distance, float half_width, float narrowest) {
    const float drawn = std::max(half_width, narrowest);
    return half_width * drawn / (drawn * drawn + distance * distance);
}
// Distance from the middle between two whole numbers.
float from_middle(float phase) { return std::abs(phase - whole_part(phase) - 0.5F); }

// Long veins along bent planes, thinner veins across them, a faint net along the zeros of a sum of octaves, and clouds.
// Width and darkness vary; wide veins are faint.
void evaluate_marble(const Recipe &recipe, Block &block, std::span<std::uint8_t> values) {
    Row bend_u, bend_v, bend_up;
    sum_octaves(recipe, block, {0.5F, 0.5F, 0.5F, 3.7F, 1, 0.5F}, bend_u);
    sum_octaves(recipe, block, {0.5F, 0.5F, 0.5F, 21.3F, 1, 0.5F}, bend_v);
    sum_octaves(recipe, block, {0.5F, 0.5F, 0.5F, 40.9F, 1, 0.5F}, bend_up);
    for (std::size_t i = 0; i < block.size; ++i) {
        block.u[i] += 0.8F * recipe.turbulence * bend_u[i];
        block.v[i] += 0.8F * recipe.turbulence * bend_v[i];
        block.up[i] += 0.8F * recipe.turbulence * bend_up[i];
    }
    Row rough, net, spread, presence;
    sum_octaves(recipe, block, {1, 1, 1, 0.0F, 8, 0.45F}, rough);
    sum_octaves(recipe, block, {1.1F, 1.1F, 1.1F, 57.1F, 5, 0.4F}, net);
    sum_octaves(recipe, block, {0.9F, 0.9F, 0.9F, 71.9F, 1, 0.5F}, spread);
    sum_octaves(recipe, block, {0.6F, 0.6F, 0.6F, 88.3F, 1, 0.5F}, presence);

    // Minimum width of a vein: one and a half samples.
    const auto narrowest = static_cast<float>(std::min(1e6, 1.5 / recipe.samples_per_unit));
    for (std::size_t i = 0; i < block.size; ++i) {
        const float jitter = recipe.turbulence * rough[i];
        const float along = 0.45F * block.u[i] + 0.30F * block.v[i] + 0.84F * block.up[i];
        const float across = 0.75F * block.u[i] - 0.55F * block.v[i] + 0.37F * block.up[i];
        const float wide = smooth_step(-0.4F, 0.6F, spread[i]);
        const float here = smooth_step(-0.5F, 0.2F, presence[i]);
        const float long_width = 0.010F + 0.085F * wide * wide;
        const float long_vein = (0.88F - 0.42F * wide) * (0.35F + 0.65F * here) *
                                vein(from_middle(0.85F * along + 0.42F * jitter), long_width, narrowest);
        const float cross_width = 0.012F + 0.03F * (1 - wide);
        const float cross_vein =
            0.55F * (1 - here) * vein(from_middle(1.1F * across - 0.5F * jitter), cross_width, narrowest);
        const float net_width = 0.010F + 0.02F * wide;
        const float net_vein = 0.30F * (1 - wide) * vein(net[i], net_width, narrowest);
        const float cloud = 0.5F + 0.9F * rough[i];
        const float light = (1 - long_vein) * (1 - cross_vein) * (1 - net_vein) * (1 - 0.17F * cloud);
        values[i] = quantise(1.03F * light);
    }
}

// Rings around the log's axis: a slow ramp of early wood, a short end of late wood; fibres and pores along the axis.
void evaluate_wood(const Recipe &recipe, Block &block, std::span<std::uint8_t> values) {
    constexpr float kStretch = 0.1F; // everything is ten times longer along the log
    Row bend_u, bend_v, rough, spacing, fibre, pores, tone, strength;
    sum_octaves(recipe, block, {0.09F, 0.09F, 0.09F * kStretch * 2, 3.7F, 2, 0.5F}, bend_u);
    sum_octaves(recipe, block, {0.09F, 0.09F, 0.09F * kStretch * 2, 21.3F, 2, 0.5F}, bend_v);
    sum_octaves(recipe, block, {0.5F, 0.5F, 0.5F * kStretch, 40.9F, 3, 0.4F}, rough);
    sum_octaves(recipe, block, {7, 7, 7 * kStretch * 0.4F, 57.1F, 3, 0.5F}, fibre);
    sum_octaves(recipe, block, {9, 9, 9 * kStretch * 0.4F, 71.9F, 1, 0.5F}, pores);
    sum_octaves(recipe, block, {0.06F, 0.06F, 0.06F * kStretch, 88.3F, 1, 0.5F}, tone);

    Row rings;
    for (std::size_t i = 0; i < block.size; ++i) {
        const float u = block.u[i] + 2.6F * recipe.turbulence * bend_u[i];
        const float v = block.v[i] + 2.6F * recipe.turbulence * bend_v[i];
        rings[i] = std::sqrt(u * u + v * v);
    }
    Block along{.size = block.size, .u = rings, .v = {}, .up = {}, .tone = {}};
    sum_octaves(recipe, along, {0.45F, 0, 0, 7.5F, 1, 0.5F}, spacing);
    for (std::size_t i = 0; i < block.size; ++i) {
        rings[i] += 0.8F * spacing[i] + 0.20F * recipe.turbulence * rough[i];
        along.u[i] = whole_part(rings[i]);
    }
    sum_octaves(recipe, along, {0.37F, 0, 0, 9.5F, 1, 0.5F}, strength);

    // Rings of fewer than six samples fade to their mean.
    const auto ring_samples = static_cast<float>(recipe.samples_per_unit);
    const float contrast = clamped((ring_samples - 2) / 4, 0, 1);
    const float end = clamped(2 / ring_samples, 0.12F, 0.5F);
    for (std::size_t i = 0; i < block.size; ++i) {
        const float part = rings[i] - whole_part(rings[i]);
        const float grown = clamped(part / (1 - end), 0, 1);
        const float late = grown * grown * (1 - smooth_step(1 - end, 1, part));
        const float ring = 0.3F + contrast * ((0.75F + 0.8F * strength[i]) * late - 0.3F);
        const float pore = smooth_step(0.2F, 0.55F, pores[i]) * (1 - 0.6F * late);
        values[i] = quantise(0.12F + 0.50F * ring + 0.16F * fibre[i] + 0.17F * pore + 0.16F * tone[i] + block.tone[i]);
    }
}

void evaluate(TextureKind kind, const Recipe &recipe, Block &block, std::span<std::uint8_t> values) {
    for (Row *const row : {&block.u, &block.v, &block.up})
        for (std::size_t i = 0; i < block.size; ++i)
            (*row)[i] = clamped((*row)[i], -kFarthest, kFarthest);
    if (kind == TextureKind::wood)
        evaluate_wood(recipe, block, values);
    else
        evaluate_marble(recipe, block, values);
}

Recipe make_recipe(const SolidTexture &texture, double samples_per_edge) {
    const float scale = clamped(texture.scale, kMinTextureScale, kMaxTextureScale);
    return {.noise = PerlinNoise(texture.seed),
            .scale = scale,
            .turbulence = clamped(texture.turbulence, 0, kMaxTurbulence),
            .samples_per_unit = samples_per_edge / static_cast<double>(scale)};
}

// Axes u, v, up of the ground plane.
std::array<std::size_t, 3> axes_of(UpAxis up) {
    const std::size_t axis = up == UpAxis::y ? 1 : up == UpAxis::z ? 2 : 0;
    return {(axis + 1) % 3, (axis + 2) % 3, axis};
}

// Moves the pith of the log behind a corner of the cube and tilts it, so that rings are cut at all angles.
void move_to_log(const Recipe &recipe, Block &block) {
    for (std::size_t i = 0; i < block.size; ++i) {
        block.u[i] += 0.12F * recipe.scale - 0.10F * block.up[i];
        block.v[i] += 0.27F * recipe.scale + 0.07F * block.up[i];
        block.tone[i] = 0;
    }
}

// A board of the floor: its place in the log.
struct Board {
    float pith_u, pith_v, along, tone;
};

// 0..1 from 16 of 64 bits.
float fraction(std::uint64_t bits, int at) { return static_cast<float>(bits >> at & 0xFFFF) / 65535; }

constexpr double kBoardsAcross = 10;
constexpr double kBoardLength = 8; // in widths
constexpr double kSeam = 0.016;    // in widths

Board cut_board(std::uint32_t seed, std::int64_t row, std::int64_t number, float width) {
    const std::uint64_t bits = scramble(scramble(seed + kGolden) + static_cast<std::uint64_t>(row) * 4096 +
                                        static_cast<std::uint64_t>(number + 64));
    return {.pith_u = width * (fraction(bits, 0) - 0.5F) * 1.6F,
            .pith_v = width * (0.25F + 1.5F * fraction(bits, 16)),
            .along = 400 * fraction(bits, 32),
            .tone = 0.22F * (fraction(bits, 48) - 0.5F)};
}

// Share of a sample of width 1 at `distance` from the middle of a seam of `width` that the seam covers.
double covered(double distance, double width) {
    const double low = std::max(distance - 0.5, -width / 2), high = std::min(distance + 0.5, width / 2);
    return std::max(0.0, high - low);
}

// A ground plane in texture space.
struct GroundRaster {
    std::uint32_t size;           // texels
    double texel;                 // edge in texture units
    std::array<double, 3> centre; // u, v, up in texture units
    double offset(std::size_t at) const { return (static_cast<double>(at) + 0.5 - size / 2.0) * texel; }
};

void place_slice(const GroundRaster &raster, std::size_t x, std::size_t y, Block &block) {
    for (std::size_t i = 0; i < block.size; ++i) {
        block.u[i] = static_cast<float>(raster.centre[0] + raster.offset(x + i));
        block.v[i] = static_cast<float>(raster.centre[1] + raster.offset(y));
        block.up[i] = static_cast<float>(raster.centre[2]);
    }
}

// Rows of boards; neighbouring rows are staggered.
void place_boards(const GroundRaster &raster, std::uint32_t seed, std::size_t x, std::size_t y, Block &block,
                  Row &seams) {
    const double width = raster.size * raster.texel / kBoardsAcross, length = width * kBoardLength;
    const double seam = kSeam * width / raster.texel; // texels
    const double across = raster.offset(y) / width + kBoardsAcross / 2;
    const auto row = static_cast<std::int64_t>(std::floor(across));
    const double from_middle = (across - static_cast<double>(row) - 0.5) * width;
    const double to_side = (width / 2 - std::abs(from_middle)) / raster.texel;
    const double stagger = static_cast<double>(fraction(scramble(static_cast<std::uint64_t>(row) * 77 + seed), 8));
    for (std::size_t i = 0; i < block.size; ++i) {
        const double u = raster.offset(x + i);
        const double along = u / length + stagger;
        const auto number = static_cast<std::int64_t>(std::floor(along));
        const double part = along - static_cast<double>(number);
        const Board board = cut_board(seed, row, number, static_cast<float>(width));
        block.u[i] = static_cast<float>(from_middle) + board.pith_u;
        block.v[i] = board.pith_v;
        block.up[i] = static_cast<float>(u) + board.along;
        block.tone[i] = board.tone;
        const double to_end = std::min(part, 1 - part) * length / raster.texel;
        seams[i] = static_cast<float>(std::max(covered(to_side, seam), covered(to_end, seam)));
    }
}

} // namespace

std::optional<TextureKind> texture_kind(std::string_view name) {
    if (name == "marble")
        return TextureKind::marble;
    if (name == "wood")
        return TextureKind::wood;
    return std::nullopt;
}

Result<SolidTexture> make_texture(const TextureOptions &options) {
    const float scale = options.scale.value_or(options.kind == TextureKind::wood ? 30.0F : 5.0F);
    if (!(scale >= kMinTextureScale && scale <= kMaxTextureScale))
        return usage_error("the scale of a texture is 0.01 to 1000 units per edge of the grid");
    if (!(options.turbulence >= 0 && options.turbulence <= kMaxTurbulence))
        return usage_error("the turbulence of a texture is 0 to 100");
    auto stops = find_colour_stops(options.kind, options.colours);
    if (!stops)
        return std::move(stops).error();
    return SolidTexture{.kind = options.kind,
                        .seed = options.seed,
                        .scale = scale,
                        .turbulence = options.turbulence,
                        .palette = make_palette(*stops)};
}

void evaluate_texture(const SolidTexture &texture, const Grid &grid, std::span<const MortonCode> codes,
                      std::span<std::uint8_t> values, int threads) {
    assert(codes.size() == values.size());
    constexpr std::size_t kTogether = 32 * kBlock;
    const auto voxels = static_cast<double>(std::uint64_t{1} << grid.depth);
    const Recipe recipe = make_recipe(texture, voxels);
    const auto voxel = static_cast<float>(static_cast<double>(recipe.scale) / voxels);
    const auto axes = axes_of(grid.up);
    parallel_blocks(codes.size(), kTogether, threads, [&](std::size_t begin, std::size_t end) {
        Block block;
        for (std::size_t first = begin; first < end; first += kBlock) {
            block.size = std::min(kBlock, end - first);
            for (std::size_t i = 0; i < block.size; ++i) {
                const auto place = morton_decode(codes[first + i]);
                block.u[i] = (static_cast<float>(place[axes[0]]) + 0.5F) * voxel;
                block.v[i] = (static_cast<float>(place[axes[1]]) + 0.5F) * voxel;
                block.up[i] = (static_cast<float>(place[axes[2]]) + 0.5F) * voxel;
            }
            if (texture.kind == TextureKind::wood)
                move_to_log(recipe, block);
            evaluate(texture.kind, recipe, block, values.subspan(first, block.size));
        }
    });
}

Image evaluate_ground_texture(const SolidTexture &texture, const Grid &grid, const GroundPlane &ground,
                              std::uint32_t size, int threads) {
    Image image{.width = size, .height = size, .channels = 1, .texels = Bytes(std::size_t{size} * size)};
    const double edges = 2 * static_cast<double>(ground.half_edge) / grid.edge();
    const Recipe recipe = make_recipe(texture, size / edges);
    GroundRaster raster{.size = size, .texel = 1 / recipe.samples_per_unit, .centre = {}};
    const auto axes = axes_of(grid.up);
    for (std::size_t axis = 0; axis < 3; ++axis)
        raster.centre[axis] =
            static_cast<double>(ground.centre[axes[axis]]) / grid.edge() * static_cast<double>(recipe.scale);
    parallel_for(size, threads, [&](std::size_t y) {
        const std::span<std::uint8_t> row(image.texels.data() + y * size, size);
        Block block;
        Row seams;
        for (std::size_t x = 0; x < size; x += kBlock) {
            block.size = std::min<std::size_t>(kBlock, size - x);
            const std::span<std::uint8_t> values = row.subspan(x, block.size);
            if (texture.kind == TextureKind::marble) {
                place_slice(raster, x, y, block);
                evaluate(texture.kind, recipe, block, values);
                continue;
            }
            place_boards(raster, texture.seed, x, y, block, seams);
            evaluate(texture.kind, recipe, block, values);
            for (std::size_t i = 0; i < block.size; ++i)
                values[i] = quantise(static_cast<float>(values[i]) / 255 + seams[i]);
        }
    });
    return image;
}

} // namespace pbm::build
