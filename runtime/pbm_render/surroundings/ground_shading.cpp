#include "pbm_render/surroundings/ground_sampler.h"
#include "pbm_render/surroundings/panorama_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/surroundings/ground_shading.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/picture/lane_vectors.h"
#include "pbm_render/surroundings/texel_filter.h"

#ifndef PBM_RENDER_GROUND_TEXELS
#define PBM_RENDER_GROUND_TEXELS
namespace pbm {

// A block's mip levels of one raster, and how far it is from one to the other.
struct BlockTexels {
    TexelLevel finer, coarser;
    float fraction = 0;
    std::optional<std::uint32_t> only; // the value of all its texels
};
struct GroundTexels {
    BlockTexels texture;
    std::array<BlockTexels, kMaxLights> lit; // [words]
};

// Where rays of a row meet the plane, near its square.
inline glm::vec2 meet(const GroundFrame &frame, const GroundRow &row, float x) {
    const glm::vec3 ray = row.first + x * row.step;
    const float t = frame.eye.z / std::max(-ray.z, 1e-20F);
    return glm::clamp(glm::vec2(frame.eye) + t * glm::vec2(ray), glm::vec2(0), glm::vec2(1));
}

// At the first, the middle and the next block's first pixel of blocks side by side: where its ray meets the plane,
// log2 of its size there in edges of the square, and the reflection of each light.
inline constexpr std::size_t kGroupBlocks = 32, kGroupSamples = 2 * kGroupBlocks + 1;
struct GroundSamples {
    using Values = std::array<float, kGroupSamples + kLaneNumbers.size()>;
    Values u, v, log_size;
    std::array<Values, kMaxLights> light;
};

// Values of a block that all its pixels share.
struct GroundBlock {
    std::size_t first; // pixel
    const GroundTexels &texels;
    const GroundSamples &samples;
    std::size_t sample; // at its first pixel
    bool is_smooth;     // reflections between samples are interpolated
    bool reads_texels;
};

// Whether straight lines through the samples of a block are as good as what is between them: a parabola is within an
// eighth of its bend, and an eighth of this is less than half of 1/255 of any sRGB colour above 1/100.
inline bool is_smooth(const GroundFrame &frame, const GroundSamples &samples, std::size_t sample) {
    constexpr float kMaxBend = 1.0F / 1024;
    float bend = 0;
    for (std::size_t i = 0; i < frame.light_count; ++i) {
        const float *const at = samples.light[i].data() + sample;
        const glm::vec3 &colour = frame.lights[i].colour;
        bend += std::abs(at[0] + at[2] - 2 * at[1]) * std::max({colour.r, colour.g, colour.b});
    }
    return bend <= kMaxBend;
}

// What a block sees of the plane: a straight line. `log_size` is that of a pixel.
struct BlockLine {
    glm::vec2 from, to;
    float log_size;
};

// Makes the texels ready that a block sees. The coarser mip level is tested first for texels that all have one value:
// then the finer ones have it too.
inline BlockTexels block_texels(const TexelLevels &texels, const BlockLine &line) {
    const float level = std::clamp(line.log_size + static_cast<float>(texels.width_bits()), 0.0F,
                                   static_cast<float>(texels.levels() - 1));
    const int number = static_cast<int>(level);
    BlockTexels result;
    result.fraction = level - static_cast<float>(number);
    const auto require = [&](int n, bool may_have_one) {
        const int width = 1 << (texels.width_bits() - n);
        // Of places far outside, whose integers overflow, and of NaN that damaged models have: a texel of the edge.
        const auto texel = [&](float place, int margin) {
            const float at = place * static_cast<float>(width);
            const float limited = at > -3.0F ? std::min(at, static_cast<float>(width + 2)) : -3.0F;
            return std::clamp(static_cast<int>(limited) + margin, 0, width - 1);
        };
        const int left = texel(std::min(line.from.x, line.to.x), -2), top = texel(std::min(line.from.y, line.to.y), -2);
        const int right = texel(std::max(line.from.x, line.to.x), 2),
                  bottom = texel(std::max(line.from.y, line.to.y), 2);
        TexelLevel ready;
        if (may_have_one)
            result.only = texels.only_value(n, left, top, right, bottom);
        if (!result.only)
            ready = texels.require(n, left, top, right, bottom);
        if (may_have_one && !result.only) // now they are ready
            result.only = texels.only_value(n, left, top, right, bottom);
        return ready;
    };
    if (result.fraction > 0)
        result.coarser = require(number + 1, true);
    if (!result.only)
        result.finer = require(number, result.fraction == 0);
    return result;
}

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

// On the plane x and y are along its edges, z is the height above it.
HWY_INLINE Vector3 broadcast(glm::vec3 v) { return broadcast(v.x, v.y, v.z); }

HWY_INLINE Vector3 rays_at(const GroundRow &row, Vector x) {
    const Floats d;
    const auto component = [&](int i) {
        return hn::Add(hn::Set(d, row.first[i]), hn::Mul(x, hn::Set(d, row.step[i])));
    };
    return {component(0), component(1), component(2)};
}

HWY_INLINE Vector depths_at(const GroundFrame &frame, const Vector3 &ray) {
    const Floats d;
    return hn::Div(hn::Set(d, frame.eye.z), hn::Max(hn::Neg(ray.z), hn::Set(d, 1e-20F)));
}

HWY_INLINE Vector columns(std::size_t x) { return hn::Add(lane_numbers(), hn::Set(Floats(), static_cast<float>(x))); }

void find_covered(const GroundFrame &frame, const GroundRow &row, const GroundPixels &pixels, std::uint8_t *wanted) {
    const Floats d;
    const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F);
    const Vector infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    for (std::size_t block = row.begin / kRayBlock; block * kRayBlock < row.end; ++block) {
        bool any = false;
        for (std::size_t x = block * kRayBlock; x < (block + 1) * kRayBlock; x += hn::Lanes(d)) {
            const Vector column = columns(x);
            Vector inside = one;
            for (const glm::vec2 &line : row.lines)
                inside = hn::Min(inside, hn::Add(hn::Set(d, line.x), hn::Mul(column, hn::Set(d, line.y))));
            Vector coverage = hn::Min(hn::Max(hn::Add(inside, half), zero), one);
            const Vector depth = depths_at(frame, rays_at(row, column));
            const Vector object = hn::LoadU(d, pixels.object_depths + x);
            // In front of the object a pixel shows one or the other.
            const auto is_free = hn::Eq(object, infinity);
            const auto is_most = hn::Ge(coverage, half);
            const auto hides = hn::And(hn::Lt(depth, object), is_most);
            coverage = hn::IfThenElse(is_free, coverage, hn::IfThenElseZero(hides, one));
            hn::StoreU(coverage, d, pixels.coverage + x);
            hn::StoreU(hn::IfThenElse(hides, depth, object), d, pixels.depths + x);
            any |= !hn::AllTrue(d, hn::Eq(coverage, zero));
        }
        wanted[block] = static_cast<std::uint8_t>(any);
    }
}

HWY_INLINE Vector values_of(const Corners &corners, int byte) {
    switch (byte) {
    case 0: return corners.values<0>();
    case 1: return corners.values<1>();
    case 2: return corners.values<2>();
    default: return corners.values<3>();
    }
}

// The texels around a place in both mip levels of a block.
class BlockCorners {
  public:
    HWY_INLINE BlockCorners() {} // an implicit constructor would not be compiled for the target
    HWY_INLINE void read(const BlockTexels &texels, const Vector3 &hit) {
        fraction_ = texels.fraction;
        finer_ = Corners(texels.finer, hit.x, hit.y, false);
        if (fraction_ != 0)
            coarser_ = Corners(texels.coarser, hit.x, hit.y, false);
    }
    // Of one of the four bytes of a texel, 0..255.
    HWY_INLINE Vector filtered(int byte) const {
        const Vector finer = values_of(finer_, byte);
        if (fraction_ == 0)
            return finer;
        const Vector coarser = values_of(coarser_, byte);
        return hn::Add(finer, hn::Mul(hn::Set(Floats(), fraction_), hn::Sub(coarser, finer)));
    }

  private:
    Corners finer_, coarser_;
    float fraction_ = 0;
};

// One byte of the texels of a block, 0..255; `corners` have been read unless all texels are the same.
HWY_INLINE Vector filtered(const BlockTexels &texels, const BlockCorners &corners, int byte) {
    return texels.only ? hn::Set(Floats(), static_cast<float>(*texels.only >> 8 * byte & 255)) : corners.filtered(byte);
}

// The colour between two entries of the palette.
HWY_INLINE Colours look_up(const GroundFrame &frame, Vector value) {
    const Floats d;
    const Ints di;
    const Vector below = hn::Floor(value);
    const IntVector index = hn::ConvertTo(di, below);
    const auto *const palette = reinterpret_cast<const std::int32_t *>(frame.palette.data());
    const auto unpacked = [&](IntVector texel) {
        const IntVector mask = hn::Set(di, 1023);
        const auto root = [&](IntVector bits) {
            const Vector r = hn::Mul(hn::ConvertTo(d, hn::And(bits, mask)), hn::Set(d, 1 / kRootSteps));
            return hn::Mul(r, r);
        };
        return Colours{root(texel), root(hn::ShiftRight<10>(texel)), root(hn::ShiftRight<20>(texel))};
    };
    return mix(unpacked(hn::GatherIndex(di, palette, index)),
               unpacked(hn::GatherIndex(di, palette, hn::Add(index, hn::Set(di, 1)))), hn::Sub(value, below));
}

// Phong's reflection of one light, as a factor of the light's colour.
HWY_INLINE Vector reflect(const GroundFrame &frame, const GroundLight &light, const Vector3 &hit,
                          const Vector3 &to_eye) {
    const Floats d;
    const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F);
    Vector3 to_light = broadcast(light.place);
    if (light.kind != LightKind::directional) {
        to_light = normalised(difference(to_light, hit));
    }
    const Material &material = frame.material;
    Vector sum = hn::Mul(hn::Set(d, material.kd), to_light.z);
    if (material.ks > 0) {
        const Vector mirrored = hn::Sub(hn::Mul(to_light.z, to_eye.z),
                                        hn::Add(hn::Mul(to_light.x, to_eye.x), hn::Mul(to_light.y, to_eye.y)));
        sum = hn::Add(
            sum, hn::Mul(hn::Set(d, material.ks), power_of(hn::Min(hn::Max(mirrored, zero), one), material.power)));
    }
    if (light.kind == LightKind::spot) {
        const Vector cosine = hn::Neg(dot(to_light, broadcast(light.direction)));
        sum = hn::Mul(sum, power_of(hn::Min(hn::Max(cosine, zero), one), light.exponent));
    }
    return sum;
}

// Where rays meet the plane, near its square.
HWY_INLINE Vector3 hits_of(const GroundFrame &frame, const Vector3 &ray) {
    const Floats d;
    const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F), depth = depths_at(frame, ray);
    const auto meets = [&](float eye, Vector along) {
        return hn::Min(hn::Max(hn::Add(hn::Set(d, eye), hn::Mul(depth, along)), zero), one);
    };
    return {meets(frame.eye.x, ray.x), meets(frame.eye.y, ray.y), zero};
}

// log2 of the size of pixels on the plane: between that of the longer way across them, which would blur, and the mean,
// which would alias.
HWY_INLINE Vector log_size(const GroundFrame &frame, const GroundRow &row, const Vector3 &ray) {
    const Floats d;
    const Vector slope = hn::Div(hn::Set(d, 1.0F), hn::Max(hn::Neg(ray.z), hn::Set(d, 1e-20F)));
    const Vector scale = hn::Mul(hn::Set(d, frame.eye.z), slope);
    const auto along = [&](const glm::vec3 &step, int axis, Vector of_ray) {
        return hn::Mul(scale, hn::Add(hn::Set(d, step[axis]), hn::Mul(hn::Mul(hn::Set(d, step.z), slope), of_ray)));
    };
    const Vector right_x = along(row.step, 0, ray.x), right_y = along(row.step, 1, ray.y);
    const Vector down_x = along(row.down, 0, ray.x), down_y = along(row.down, 1, ray.y);
    const auto squared = [](Vector x, Vector y) { return hn::Add(hn::Mul(x, x), hn::Mul(y, y)); };
    const Vector longer = hn::Max(squared(right_x, right_y), squared(down_x, down_y));
    const Vector area = hn::Abs(hn::Sub(hn::Mul(right_x, down_y), hn::Mul(right_y, down_x)));
    return hn::Mul(hn::Add(log2_of(longer), log2_of(area)), hn::Set(d, 0.25F));
}

// Fills the samples of `blocks` blocks.
void take_samples(const GroundFrame &frame, const GroundRow &row, std::size_t first_block, std::size_t blocks,
                  GroundSamples &samples) {
    const Floats d;
    constexpr std::size_t kStep = kRayBlock / 2;
    for (std::size_t i = 0; i <= 2 * blocks; i += hn::Lanes(d)) {
        const Vector number = columns(2 * first_block + i);
        const Vector3 ray = rays_at(row, hn::Mul(number, hn::Set(d, static_cast<float>(kStep))));
        const Vector3 hit = hits_of(frame, ray), to_eye = normalised(negated(ray));
        hn::StoreU(hit.x, d, samples.u.data() + i);
        hn::StoreU(hit.y, d, samples.v.data() + i);
        hn::StoreU(log_size(frame, row, ray), d, samples.log_size.data() + i);
        for (std::size_t light = 0; light < frame.light_count; ++light)
            hn::StoreU(reflect(frame, frame.lights[light], hit, to_eye), d, samples.light[light].data() + i);
    }
}

// Pixels `at` .. of a block between its samples.
class BetweenSamples {
  public:
    explicit HWY_INLINE BetweenSamples(std::size_t at) {
        const Floats d;
        const Vector one = hn::Set(d, 1.0F);
        const Vector t = hn::Mul(columns(at), hn::Set(d, 2.0F / kRayBlock));
        first_ = hn::Min(t, one);
        second_ = hn::Max(hn::Sub(t, one), hn::Zero(d));
    }
    HWY_INLINE Vector operator()(const float *samples) const {
        const Floats d;
        return hn::Add(hn::Add(hn::Set(d, samples[0]), hn::Mul(first_, hn::Set(d, samples[1] - samples[0]))),
                       hn::Mul(second_, hn::Set(d, samples[2] - samples[1])));
    }

  private:
    Vector first_, second_;
};

// Of the pixels from `x` on.
HWY_INLINE Colours shade_vector(const GroundFrame &frame, const GroundBlock &block, std::size_t x, const Vector3 &ray) {
    const GroundTexels &texels = block.texels;
    const BetweenSamples between(x - block.first);
    const Floats d;
    Vector3 hit = broadcast(0, 0, 0), to_eye = hit;
    if (block.reads_texels || !block.is_smooth)
        hit = hits_of(frame, ray);
    if (!block.is_smooth)
        to_eye = normalised(negated(ray));
    const Vector ambient = hn::Set(d, frame.material.ka);
    Colours light{ambient, ambient, ambient};
    BlockCorners lit; // of the last light's word, which is often that of the next
    int word = -1;
    for (std::size_t i = 0; i < frame.light_count; ++i) {
        const GroundLight &one = frame.lights[i];
        Vector factor =
            block.is_smooth ? between(block.samples.light[i].data() + block.sample) : reflect(frame, one, hit, to_eye);
        if (one.word >= 0) {
            const BlockTexels &from = texels.lit[static_cast<std::size_t>(one.word)];
            if (!from.only && std::exchange(word, one.word) != one.word)
                lit.read(from, hit);
            const Vector value =
                from.only ? hn::Set(d, static_cast<float>(*from.only >> 8 * one.byte & 255)) : lit.filtered(one.byte);
            factor = hn::Mul(factor, hn::Mul(value, hn::Set(d, 1.0F / 255)));
        }
        light.red = hn::Add(light.red, hn::Mul(factor, hn::Set(d, one.colour.r)));
        light.green = hn::Add(light.green, hn::Mul(factor, hn::Set(d, one.colour.g)));
        light.blue = hn::Add(light.blue, hn::Mul(factor, hn::Set(d, one.colour.b)));
    }
    Colours own{hn::Set(d, frame.colour.r), hn::Set(d, frame.colour.g), hn::Set(d, frame.colour.b)};
    if (frame.has_texture) {
        BlockCorners texture;
        if (!texels.texture.only)
            texture.read(texels.texture, hit);
        own = look_up(frame, filtered(texels.texture, texture, 0));
    }
    // As a point's: brighter than white is white, also before it is blended with a mirror's picture.
    const Vector white = hn::Set(d, 1.0F);
    return {hn::Min(hn::Mul(light.red, own.red), white), hn::Min(hn::Mul(light.green, own.green), white),
            hn::Min(hn::Mul(light.blue, own.blue), white)};
}

// Puts `over` with some coverage over what there is.
HWY_INLINE void blend(const Colours &over, Vector coverage, std::size_t x, const GroundPixels &pixels) {
    const Floats d;
    const Vector one = hn::Set(d, 1.0F);
    const Mask whole = hn::Eq(coverage, one);
    if (hn::AllTrue(d, whole)) {
        hn::StoreU(over.red, d, pixels.red + x);
        hn::StoreU(over.green, d, pixels.green + x);
        hn::StoreU(over.blue, d, pixels.blue + x);
        hn::StoreU(one, d, pixels.alpha + x);
        return;
    }
    const Vector below = hn::Mul(hn::Sub(one, coverage), hn::LoadU(d, pixels.alpha + x));
    const Vector alpha = hn::Add(coverage, below);
    const auto visible = hn::Gt(coverage, hn::Zero(d));
    const Vector share = hn::Div(coverage, hn::Max(alpha, hn::Set(d, 1e-6F)));
    const auto put = [&](Vector colour, float *to) {
        const Vector old = hn::LoadU(d, to + x);
        const Vector mixed = hn::IfThenElse(visible, hn::Add(old, hn::Mul(share, hn::Sub(colour, old))), old);
        hn::StoreU(hn::IfThenElse(whole, colour, mixed), d, to + x);
    };
    put(over.red, pixels.red);
    put(over.green, pixels.green);
    put(over.blue, pixels.blue);
    hn::StoreU(alpha, d, pixels.alpha + x);
}

void shade_block(const GroundFrame &frame, const GroundRow &row, const GroundBlock &block, const GroundPixels &pixels) {
    const Floats d;
    for (std::size_t x = block.first; x < block.first + kRayBlock; x += hn::Lanes(d)) {
        const Vector coverage = hn::LoadU(d, pixels.coverage + x);
        if (hn::AllTrue(d, hn::Eq(coverage, hn::Zero(d))))
            continue;
        Colours colours = shade_vector(frame, block, x, rays_at(row, columns(x)));
        if (frame.mirror > 0)
            colours = mix(colours,
                          {hn::LoadU(d, pixels.mirrored_red + x), hn::LoadU(d, pixels.mirrored_green + x),
                           hn::LoadU(d, pixels.mirrored_blue + x)},
                          hn::Set(d, frame.mirror));
        blend(colours, coverage, x, pixels);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(find_covered);
HWY_EXPORT(take_samples);
HWY_EXPORT(shade_block);

void GroundSampler::find_covered(const GroundFrame &frame, const GroundRow &row, const GroundPixels &pixels,
                                 std::uint8_t *wanted) {
    HWY_DYNAMIC_DISPATCH(find_covered)(frame, row, pixels, wanted);
}

void GroundSampler::shade(const GroundFrame &frame, const GroundRow &row, const std::uint8_t *wanted,
                          const GroundPixels &pixels) const {
    std::array<bool, kMaxLights> is_lit{};
    for (std::size_t i = 0; i < frame.light_count; ++i)
        if (frame.lights[i].word >= 0)
            is_lit[static_cast<std::size_t>(frame.lights[i].word)] = true;
    GroundTexels texels;
    GroundSamples samples;
    const std::size_t end = (row.end + kRayBlock - 1) / kRayBlock;
    std::size_t group = 0, group_end = 0; // blocks that have samples
    for (std::size_t block = row.begin / kRayBlock; block < end; ++block) {
        if (wanted[block] == 0)
            continue;
        if (block >= group_end) {
            group = block;
            group_end = std::min(end, group + kGroupBlocks);
            HWY_DYNAMIC_DISPATCH(take_samples)(frame, row, group, group_end - group, samples);
        }
        const std::size_t first = block * kRayBlock, sample = 2 * (block - group);
        const auto place = [&](std::size_t at, std::size_t x) {
            return first + kRayBlock / 2 * (at - sample) == x ? glm::vec2(samples.u[at], samples.v[at])
                                                              : meet(frame, row, static_cast<float>(x));
        };
        const BlockLine line{place(sample, std::max(first, row.begin)),
                             place(sample + 2, std::min(first + kRayBlock, row.end)), samples.log_size[sample + 1]};
        bool reads_texels = false;
        if (frame.has_texture) {
            texels.texture = block_texels(*texture_, line);
            reads_texels = !texels.texture.only;
        }
        for (std::size_t word = 0; word < frame.lit.size(); ++word)
            if (is_lit[word]) {
                texels.lit[word] = block_texels(*frame.lit[word], line);
                reads_texels |= !texels.lit[word].only;
            }
        const GroundBlock values{first, texels, samples, sample, is_smooth(frame, samples, sample), reads_texels};
        HWY_DYNAMIC_DISPATCH(shade_block)(frame, row, values, pixels);
    }
}

} // namespace pbm
#endif // HWY_ONCE
