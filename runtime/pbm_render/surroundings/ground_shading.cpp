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

// Size of a pixel on the plane, in edges of the square: between that of the longer way across it, which would blur,
// and the mean, which would alias.
inline float pixel_size(const GroundFrame &frame, const GroundRow &row, float x) {
    const glm::vec3 ray = row.first + x * row.step;
    const float slope = 1 / std::max(-ray.z, 1e-20F);
    const auto across = [&](glm::vec3 step) {
        return frame.eye.z * slope * (glm::vec2(step) + step.z * slope * glm::vec2(ray));
    };
    const glm::vec2 dx = across(row.step), dy = across(row.down);
    const float longer = std::sqrt(std::max(glm::dot(dx, dx), glm::dot(dy, dy)));
    const float mean = std::sqrt(std::abs(dx.x * dy.y - dx.y * dy.x));
    return std::sqrt(longer * mean);
}

// Makes ready what the pixels x .. to_x see, which lies on a straight line.
inline BlockTexels block_texels(const TexelLevels &texels, const GroundFrame &frame, const GroundRow &row, float x,
                                float to_x) {
    const float columns = static_cast<float>(1 << texels.width_bits());
    const float size = pixel_size(frame, row, (x + to_x) / 2) * columns;
    const float level = size > 1 ? std::min(std::log2(size), static_cast<float>(texels.levels() - 1)) : 0.0F; // NaN: 0
    const int number = static_cast<int>(level);
    const glm::vec2 from = meet(frame, row, x), to = meet(frame, row, to_x);
    const auto require = [&](int n) {
        const int width = 1 << (texels.width_bits() - n);
        const auto texel = [&](float place, int margin) {
            return std::clamp(static_cast<int>(place * static_cast<float>(width)) + margin, 0, width - 1);
        };
        return texels.require(n, texel(std::min(from.x, to.x), -2), texel(std::min(from.y, to.y), -2),
                              texel(std::max(from.x, to.x), 2), texel(std::max(from.y, to.y), 2));
    };
    BlockTexels result;
    result.finer = require(number);
    result.fraction = level - static_cast<float>(number);
    if (result.fraction > 0)
        result.coarser = require(number + 1);
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
        sum = hn::Add(sum, hn::Mul(hn::Set(d, material.ks),
                                   power_of(hn::Min(hn::Max(mirrored, zero), one), hn::Set(d, material.power))));
    }
    if (light.kind == LightKind::spot) {
        const Vector cosine = hn::Neg(dot(to_light, broadcast(light.direction)));
        sum = hn::Mul(sum, power_of(hn::Min(hn::Max(cosine, zero), one), hn::Set(d, light.exponent)));
    }
    return sum;
}

HWY_INLINE Colours shade_vector(const GroundFrame &frame, const GroundTexels &texels, const Vector3 &hit,
                                const Vector3 &to_eye) {
    const Floats d;
    const Vector ambient = hn::Set(d, frame.material.ka);
    Colours light{ambient, ambient, ambient};
    BlockCorners lit; // of the last light's word, which is often that of the next
    int word = -1;
    for (std::size_t i = 0; i < frame.light_count; ++i) {
        const GroundLight &one = frame.lights[i];
        Vector factor = reflect(frame, one, hit, to_eye);
        if (one.word >= 0) {
            if (std::exchange(word, one.word) != one.word)
                lit.read(texels.lit[static_cast<std::size_t>(one.word)], hit);
            factor = hn::Mul(factor, hn::Mul(lit.filtered(one.byte), hn::Set(d, 1.0F / 255)));
        }
        light.red = hn::Add(light.red, hn::Mul(factor, hn::Set(d, one.colour.r)));
        light.green = hn::Add(light.green, hn::Mul(factor, hn::Set(d, one.colour.g)));
        light.blue = hn::Add(light.blue, hn::Mul(factor, hn::Set(d, one.colour.b)));
    }
    Colours own{hn::Set(d, frame.colour.r), hn::Set(d, frame.colour.g), hn::Set(d, frame.colour.b)};
    if (frame.has_texture) {
        BlockCorners texture;
        texture.read(texels.texture, hit);
        own = look_up(frame, texture.filtered(0));
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
    const Vector below = hn::Mul(hn::Sub(one, coverage), hn::LoadU(d, pixels.alpha + x));
    const Vector alpha = hn::Add(coverage, below);
    const auto visible = hn::Gt(coverage, hn::Zero(d));
    const Vector share = hn::Div(coverage, hn::Max(alpha, hn::Set(d, 1e-6F)));
    const auto put = [&](Vector colour, float *to) {
        const Vector old = hn::LoadU(d, to + x);
        hn::StoreU(hn::IfThenElse(visible, hn::Add(old, hn::Mul(share, hn::Sub(colour, old))), old), d, to + x);
    };
    put(over.red, pixels.red);
    put(over.green, pixels.green);
    put(over.blue, pixels.blue);
    hn::StoreU(alpha, d, pixels.alpha + x);
}

void shade_block(const GroundFrame &frame, const GroundRow &row, const GroundTexels &texels, std::size_t first,
                 const GroundPixels &pixels) {
    const Floats d;
    for (std::size_t x = first; x < first + kRayBlock; x += hn::Lanes(d)) {
        const Vector coverage = hn::LoadU(d, pixels.coverage + x);
        if (hn::AllTrue(d, hn::Eq(coverage, hn::Zero(d))))
            continue;
        const Vector3 ray = rays_at(row, columns(x));
        const Vector depth = depths_at(frame, ray);
        const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F);
        const auto meets = [&](float eye, Vector along) { // near the square
            return hn::Min(hn::Max(hn::Add(hn::Set(d, eye), hn::Mul(depth, along)), zero), one);
        };
        const Vector3 hit{meets(frame.eye.x, ray.x), meets(frame.eye.y, ray.y), zero};
        const Vector3 to_eye = normalised(negated(ray));
        Colours colours = shade_vector(frame, texels, hit, to_eye);
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
    for (std::size_t block = row.begin / kRayBlock; block * kRayBlock < row.end; ++block) {
        if (wanted[block] == 0)
            continue;
        const std::size_t first = block * kRayBlock;
        const auto x = static_cast<float>(std::max(first, row.begin));
        const auto to_x = static_cast<float>(std::min(first + kRayBlock, row.end) - 1);
        if (frame.has_texture)
            texels.texture = block_texels(*texture_, frame, row, x, to_x);
        for (std::size_t word = 0; word < lit_.size(); ++word)
            if (is_lit[word])
                texels.lit[word] = block_texels(*lit_[word], frame, row, x, to_x);
        HWY_DYNAMIC_DISPATCH(shade_block)(frame, row, texels, first, pixels);
    }
}

} // namespace pbm
#endif // HWY_ONCE
