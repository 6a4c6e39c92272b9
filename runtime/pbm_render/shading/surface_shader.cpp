#include "pbm_render/shading/surface_shader.h"

#include <glm/geometric.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/shading/surface_shader.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/picture/lane_vectors.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

HWY_INLINE Vector3 broadcast(const std::array<float, 3> &v) { return broadcast(v[0], v[1], v[2]); }

// Values of a vector of pixels that all lights share.
struct Pixels {
    Vector3 place, normal, to_eye;
    Vector kd, ks, power;
};

// What a light of intensity 1 adds to the reflection of a white surface.
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
