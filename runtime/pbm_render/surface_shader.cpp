#include "pbm_render/surface_shader.h"

#include <glm/geometric.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/surface_shader.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/packing.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

struct Vector3 {
    Vector x, y, z;
};

HWY_INLINE Vector dot(const Vector3 &a, const Vector3 &b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vector3 scaled(const Vector3 &v, Vector by) {
    return {hn::Mul(v.x, by), hn::Mul(v.y, by), hn::Mul(v.z, by)};
}
HWY_INLINE Vector3 difference(const Vector3 &a, const Vector3 &b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vector3 normalised(const Vector3 &v) {
    const Floats d;
    return scaled(v, hn::Div(hn::Set(d, 1), hn::Sqrt(hn::Max(dot(v, v), hn::Set(d, 1e-30F)))));
}
HWY_INLINE Vector3 broadcast(const std::array<float, 3> &v) {
    const Floats d;
    return {hn::Set(d, v[0]), hn::Set(d, v[1]), hn::Set(d, v[2])};
}

// Coefficients from the highest power down.
template <std::size_t kCount> HWY_INLINE Vector polynomial(Vector x, const std::array<float, kCount> &coefficients) {
    const Floats d;
    Vector sum = hn::Set(d, coefficients[0]);
    for (std::size_t i = 1; i < kCount; ++i)
        sum = hn::Add(hn::Mul(sum, x), hn::Set(d, coefficients[i]));
    return sum;
}

// x^power for 0 <= x and 0 < power, within 1e-5 of it for results that are seen: 2^(power * log2 x), both by
// polynomials, since no two libraries agree in the last bits of theirs.
HWY_INLINE Vector power_of(Vector x, Vector power) {
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    // x = 2^e * m with m in sqrt(1/2) .. sqrt(2)
    const IntVector bits = hn::BitCast(di, hn::Max(x, set(1e-30F)));
    const IntVector from_root = hn::Sub(bits, hn::Set(di, 0x3F3504F3));
    const IntVector e = hn::ShiftRight<23>(from_root);
    const Vector m = hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(e)));
    // log2 m = 2 / ln 2 * artanh((m - 1) / (m + 1))
    const Vector s = hn::Div(hn::Sub(m, set(1)), hn::Add(m, set(1)));
    const Vector log = hn::Mul(
        s, polynomial(hn::Mul(s, s), std::array{0.32058690F, 0.41219858F, 0.57707802F, 0.96179669F, 2.88539008F}));
    const Vector exponent = hn::Max(hn::Mul(power, hn::Add(hn::ConvertTo(d, e), log)), set(-126));
    const Vector whole = hn::Round(exponent), rest = hn::Sub(exponent, whole); // -0.5 .. 0.5
    // 2^rest by its Taylor series
    const Vector fraction = polynomial(rest, std::array{1.5403530e-4F, 1.3333558e-3F, 9.6181291e-3F, 5.5504109e-2F,
                                                        2.4022651e-1F, 6.9314718e-1F, 1.0F});
    const IntVector scale = hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, whole), hn::Set(di, 127)));
    return hn::Mul(fraction, hn::BitCast(d, scale));
}

// What is the same for all lights of a vector of pixels.
struct Pixels {
    Vector3 place, normal, to_eye;
    Vector kd, ks, power;
};

// What a light adds to the reflection of a white surface, but for the light's colour.
HWY_INLINE Vector reflect(const EyeLight &light, const Pixels &pixels) {
    const Floats d;
    const Vector zero = hn::Zero(d);
    const Vector3 travel = broadcast(light.direction);
    Vector3 to_light = scaled(travel, hn::Set(d, -1));
    if (light.kind != LightKind::directional)
        to_light = normalised(difference(broadcast(light.place), pixels.place));
    const Vector diffuse = dot(pixels.normal, to_light);
    const Vector3 mirrored = difference(scaled(pixels.normal, hn::Add(diffuse, diffuse)), to_light);
    const Vector shine = dot(mirrored, pixels.to_eye);
    Vector sum = hn::Mul(pixels.kd, diffuse);
    const Mask shines = hn::And(hn::Gt(shine, zero), hn::Gt(pixels.ks, zero));
    if (!hn::AllFalse(d, shines))
        sum = hn::Add(sum, hn::IfThenElseZero(shines, hn::Mul(pixels.ks, power_of(shine, pixels.power))));
    if (light.kind == LightKind::spot) {
        const Vector cosine = hn::Sub(zero, dot(to_light, travel));
        sum = hn::Mul(sum, hn::IfThenElseZero(hn::Gt(cosine, zero), power_of(cosine, hn::Set(d, light.exponent))));
    }
    return hn::IfThenElseZero(hn::Gt(diffuse, zero), sum);
}

void shade_row(const EyeRays &rays, std::span<const EyeLight> lights, std::size_t shadowed, float screen_y,
               SurfaceRow &row) {
    const Floats d;
    const Vector one = hn::Set(d, 1), inverse_focal = hn::Set(d, rays.inverse_focal);
    const Vector ray_y = hn::Set(d, (screen_y - rays.middle_y) * rays.inverse_focal);
    for (std::size_t i = 0; i < row.count; i += hn::Lanes(d)) {
        const auto load = [&](const std::vector<float> &from) { return hn::LoadU(d, from.data() + i); };
        const Vector3 ray{hn::Mul(hn::Sub(load(row.screen_x), hn::Set(d, rays.middle_x)), inverse_focal), ray_y, one};
        const Pixels pixels{.place = scaled(ray, load(row.depth)),
                            .normal = {load(row.normal[0]), load(row.normal[1]), load(row.normal[2])},
                            .to_eye = normalised(scaled(ray, hn::Set(d, -1))),
                            .kd = load(row.phong[1]),
                            .ks = load(row.phong[2]),
                            .power = load(row.phong[3])};
        const Vector ambient = load(row.phong[0]);
        Vector3 light{ambient, ambient, ambient};
        for (std::size_t l = 0; l < lights.size(); ++l) {
            Vector added = reflect(lights[l], pixels);
            if (l < shadowed)
                added = hn::Mul(added, load(row.lit[l]));
            const Vector3 coloured = scaled(broadcast(lights[l].intensity), added);
            light = {hn::Add(light.x, coloured.x), hn::Add(light.y, coloured.y), hn::Add(light.z, coloured.z)};
        }
        const auto colour = [&](std::vector<float> &of, Vector by) {
            hn::StoreU(hn::Mul(hn::LoadU(d, of.data() + i), by), d, of.data() + i);
        };
        colour(row.colour[0], light.x);
        colour(row.colour[1], light.y);
        colour(row.colour[2], light.z);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(shade_row);

void shade_row(const EyeRays &rays, std::span<const EyeLight> lights, std::size_t shadowed, float screen_y,
               SurfaceRow &row) {
    HWY_DYNAMIC_DISPATCH(shade_row)(rays, lights, shadowed, screen_y, row);
}

SurfaceRow::SurfaceRow(int width)
    : x(static_cast<std::size_t>(width) + kLaneNumbers.size()), screen_x(x.size()), depth(x.size()),
      environment(x.size()) {
    for (auto *arrays : {&normal, &colour})
        for (std::vector<float> &array : *arrays)
            array.resize(x.size());
    for (std::vector<float> &array : phong)
        array.resize(x.size());
    for (std::vector<float> &array : lit)
        array.resize(x.size());
}

std::vector<EyeLight> see_lights(std::span<const Light> lights, double grid_edge, const Projection &projection) {
    const auto in_eye_space = [&](glm::dvec3 v) {
        const EyeAxes &axes = projection.axes;
        return std::array{static_cast<float>(glm::dot(v, axes.right)), static_cast<float>(-glm::dot(v, axes.up)),
                          static_cast<float>(glm::dot(v, axes.forward))};
    };
    std::vector<EyeLight> seen;
    for (const Light &light : lights) {
        const glm::dvec3 place(light.position[0], light.position[1], light.position[2]);
        const glm::dvec3 direction(light.direction[0], light.direction[1], light.direction[2]);
        seen.push_back({.kind = light.kind,
                        .intensity = light.intensity,
                        .place = in_eye_space(place / grid_edge - projection.eye),
                        .direction = in_eye_space(direction),
                        .exponent = light.exponent});
    }
    return seen;
}

} // namespace pbm
#endif // HWY_ONCE
