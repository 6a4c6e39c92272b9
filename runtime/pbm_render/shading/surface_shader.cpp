#include "pbm_render/shading/surface_shader.h"

#include "pbm_format/model/normal.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/shading/surface_shader.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/picture/lane_vectors.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

HWY_INLINE Vector3 broadcast(const std::array<float, 3> &v) { return broadcast(v[0], v[1], v[2]); }

// Values of a vector of pixels that all lights share. Power: Vector, or float where all pixels have the same.
template <class Power> struct Pixels {
    Vector3 place, normal;
    Vector kd, ks;
    Power power;
};

// Where the eye is. Cosine: of the angle between a direction and that to the eye.
struct NearEye {
    Vector3 to_eye;
    HWY_INLINE Vector cosine(const Vector3 &direction) const { return dot(direction, to_eye); }
};
struct FarEye {
    HWY_INLINE Vector cosine(const Vector3 &direction) const { return hn::Neg(direction.z); }
};

// What a light of intensity 1 adds to the reflection of a white surface.
template <class Power, class Eye>
HWY_INLINE Vector reflect(const EyeLight &light, const Pixels<Power> &pixels, const Eye &eye) {
    const Floats d;
    const Vector zero = hn::Zero(d);
    const Vector3 travel = broadcast(light.direction);
    Vector3 to_light = negated(travel);
    if (light.kind != LightKind::directional)
        to_light = normalised(difference(broadcast(light.place), pixels.place));
    const Vector diffuse = dot(pixels.normal, to_light);
    const Mask faces = hn::Gt(diffuse, zero);
    if (hn::AllFalse(d, faces))
        return zero;
    const Vector twice = hn::Add(diffuse, diffuse); // the mirrored ray is twice * normal - to_light
    const Vector shine = hn::Sub(hn::Mul(twice, eye.cosine(pixels.normal)), eye.cosine(to_light));
    Vector sum = hn::Mul(pixels.kd, diffuse);
    const Mask shines = hn::And(hn::Gt(shine, zero), hn::Gt(pixels.ks, zero));
    if (!hn::AllFalse(d, shines))
        sum = hn::Add(sum, hn::IfThenElseZero(shines, hn::Mul(pixels.ks, power_of(shine, pixels.power))));
    if (light.kind == LightKind::spot) {
        const Vector cosine = hn::Sub(zero, dot(to_light, travel));
        sum = hn::Mul(sum, hn::IfThenElseZero(hn::Gt(cosine, zero), power_of(cosine, light.exponent)));
    }
    return hn::IfThenElseZero(faces, sum);
}

// Adds `factor` of a light, times the lit fractions if there are any.
HWY_INLINE Vector3 with_light(const Vector3 &light, const EyeLight &of, Vector factor, const float *lit) {
    if (lit != nullptr)
        factor = hn::Mul(factor, hn::LoadU(Floats(), lit));
    const Vector3 coloured = scaled(broadcast(of.intensity), factor);
    return {hn::Add(light.x, coloured.x), hn::Add(light.y, coloured.y), hn::Add(light.z, coloured.z)};
}

void shade_row(const EyeRays &rays, std::span<const EyeLight> lights, std::size_t shadowed, float screen_y,
               SurfaceRow &row) {
    const Floats d;
    const Vector one = hn::Set(d, 1), inverse_focal = hn::Set(d, rays.inverse_focal);
    const Vector ray_y = hn::Set(d, (screen_y - rays.middle_y) * rays.inverse_focal);
    for (std::size_t i = 0; i < row.count; i += hn::Lanes(d)) {
        const auto load = [&](const std::vector<float> &from) { return hn::LoadU(d, from.data() + i); };
        const Vector3 ray{hn::Mul(hn::Sub(load(row.screen_x), hn::Set(d, rays.middle_x)), inverse_focal), ray_y, one};
        const Pixels<Vector> pixels{.place = scaled(ray, load(row.depth)),
                                    .normal = {load(row.normal[0]), load(row.normal[1]), load(row.normal[2])},
                                    .kd = load(row.phong[1]),
                                    .ks = load(row.phong[2]),
                                    .power = load(row.phong[3])};
        const NearEye eye{normalised(negated(ray))};
        const Vector ambient = load(row.phong[0]);
        Vector3 light{ambient, ambient, ambient};
        for (std::size_t l = 0; l < lights.size(); ++l)
            light = with_light(light, lights[l], reflect(lights[l], pixels, eye),
                               l < shadowed ? row.lit[l].data() + i : nullptr);
        const auto colour = [&](std::vector<float> &of, Vector by) {
            hn::StoreU(hn::Mul(hn::LoadU(d, of.data() + i), by), d, of.data() + i);
        };
        colour(row.colour[0], light.x);
        colour(row.colour[1], light.y);
        colour(row.colour[2], light.z);
    }
}

// The light on white points `first` .. of a row.
template <class Power>
HWY_INLINE Vector3 light_points(const PointLighting &lighting, const Pixels<Power> &pixels, Vector ambient,
                                const Vector3 &ray, const PointRow &row, std::size_t first) {
    Vector3 light{ambient, ambient, ambient};
    NearEye eye{ray};
    if (lighting.has_places)
        eye.to_eye = normalised(negated(ray));
    for (std::size_t l = 0; l < lighting.lights.size(); ++l) {
        const EyeLight &of = lighting.lights[l];
        const Vector factor =
            of.kind == LightKind::directional ? reflect(of, pixels, FarEye{}) : reflect(of, pixels, eye);
        light = with_light(light, of, factor, l < lighting.shadowed ? row.lit[l].data() + first : nullptr);
    }
    return light;
}

// Unit normals in eye space; those of two-sided points are turned to the eye.
HWY_INLINE Vector3 normals_of(IntVector codes, const PointLighting &lighting, const Vector3 &ray) {
    const Floats d;
    const Ints di;
    const IntVector mask = hn::Set(di, 127), sign = hn::Set(di, std::numeric_limits<std::int32_t>::min());
    const Vector x = hn::ConvertTo(d, hn::And(codes, mask)),
                 y = hn::ConvertTo(d, hn::And(hn::ShiftRight<7>(codes), mask));
    const Vector3 unit = normalised({x, y, hn::Sub(hn::Set(d, 96.0F), hn::Add(x, y))});
    const auto signed_by = [&](Vector value, IntVector bits) {
        return hn::Xor(value, hn::BitCast(d, hn::And(bits, sign)));
    };
    const Vector3 in_model{signed_by(unit.x, hn::ShiftLeft<5>(codes)), signed_by(unit.y, hn::ShiftLeft<4>(codes)),
                           signed_by(unit.z, hn::ShiftLeft<3>(codes))};
    const Vector3 normal{dot(in_model, broadcast(lighting.axes[0])), dot(in_model, broadcast(lighting.axes[1])),
                         dot(in_model, broadcast(lighting.axes[2]))};
    const IntVector two_sided = hn::And(hn::ShiftLeft<2>(codes), sign);
    if (hn::AllTrue(di, hn::Eq(two_sided, hn::Zero(di))))
        return normal;
    const Vector turned = hn::IfThenElseZero(hn::Gt(dot(normal, ray), hn::Zero(d)), hn::BitCast(d, two_sided));
    return {hn::Xor(normal.x, turned), hn::Xor(normal.y, turned), hn::Xor(normal.z, turned)};
}

void shade_points(const PointLighting &lighting, const PixelPlaces &places, PointRow &row) {
    const Floats d;
    const Ints di;
    const Vector one = hn::Set(d, 1), inverse_focal = hn::Set(d, lighting.rays.inverse_focal);
    const Vector middle_x = hn::Set(d, lighting.rays.middle_x - 0.5F);
    const Vector ray_y = hn::Set(d, (places.screen_y - lighting.rays.middle_y) * lighting.rays.inverse_focal);
    auto *const colours = reinterpret_cast<std::int32_t *>(row.colour.data());
    const auto *const normals = reinterpret_cast<const std::int32_t *>(row.normal.data());
    const Float4 &only = row.phong[0];
    for (std::size_t i = 0; i < row.count; i += hn::Lanes(d)) {
        const Vector x = hn::ConvertTo(d, hn::LoadU(di, places.x + i));
        const Vector3 ray{hn::Mul(hn::Sub(x, middle_x), inverse_focal), ray_y, one};
        const Vector3 place = scaled(ray, hn::LoadU(d, places.depth + i));
        const Vector3 normal = normals_of(hn::LoadU(di, normals + i), lighting, ray);
        Vector3 light;
        if (lighting.one_material) {
            const Pixels<float> pixels{place, normal, hn::Set(d, only[0]), hn::Set(d, only[1]), only[2]};
            light = light_points(lighting, pixels, hn::Set(d, only[3]), ray, row, i);
        } else {
            Vector kd, ks, power, ka;
            hn::LoadInterleaved4(d, reinterpret_cast<const float *>(row.phong.data() + i), kd, ks, power, ka);
            light = light_points(lighting, Pixels<Vector>{place, normal, kd, ks, power}, ka, ray, row, i);
        }
        const IntVector own = hn::LoadU(di, colours + i);
        Vector3 colour{hn::Mul(light.x, linear_light<0>(own)), hn::Mul(light.y, linear_light<8>(own)),
                       hn::Mul(light.z, linear_light<16>(own))};
        if (lighting.mirrors) {
            Vector red, green, blue, share;
            hn::LoadInterleaved4(d, reinterpret_cast<const float *>(row.mirrored.data() + i), red, green, blue, share);
            const auto blend = [&](Vector from, Vector to) {
                const Vector shown = hn::Min(from, one);
                return hn::Add(shown, hn::Mul(share, hn::Sub(to, shown)));
            };
            colour = {blend(colour.x, red), blend(colour.y, green), blend(colour.z, blue)};
        }
        const IntVector red = srgb_bytes(colour.x), green = hn::ShiftLeft<8>(srgb_bytes(colour.y)),
                        blue = hn::ShiftLeft<16>(srgb_bytes(colour.z)),
                        opaque = hn::Set(di, static_cast<std::int32_t>(0xFF000000U));
        hn::StoreU(hn::Or(hn::Or(red, green), hn::Or(blue, opaque)), di, colours + i);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(shade_row);
HWY_EXPORT(shade_points);

void shade_row(const EyeRays &rays, std::span<const EyeLight> lights, std::size_t shadowed, float screen_y,
               SurfaceRow &row) {
    HWY_DYNAMIC_DISPATCH(shade_row)(rays, lights, shadowed, screen_y, row);
}

void shade_points(const PointLighting &lighting, const PixelPlaces &places, PointRow &row) {
    HWY_DYNAMIC_DISPATCH(shade_points)(lighting, places, row);
}

const NormalSums &normal_sums() {
    static const NormalSums kSums = [] {
        NormalSums sums{};
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const std::array<int, 3> sum = normal_lattice_sum(static_cast<std::uint16_t>(i));
            sums[i] = static_cast<std::uint16_t>(sum[0] + 128 * sum[1]);
        }
        return sums;
    }();
    return kSums;
}

PointRow::PointRow(int width)
    : colour(static_cast<std::size_t>(width) + kLaneNumbers.size()), normal(colour.size()), phong(colour.size()),
      mirrored(colour.size()) {
    for (std::vector<float> &array : lit)
        array.resize(colour.size());
}

PointLighting make_point_lighting(const EyeRays &rays, const Projection &projection, std::span<const EyeLight> lights) {
    const auto floats = [](glm::dvec3 v) {
        return std::array{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
    };
    const EyeAxes &axes = projection.axes;
    const bool has_places = std::any_of(lights.begin(), lights.end(),
                                        [](const EyeLight &light) { return light.kind != LightKind::directional; });
    return {rays, {floats(axes.right), floats(-axes.up), floats(axes.forward)}, lights, has_places, 0, false, false};
}

SurfaceRow::SurfaceRow(int width)
    : x(static_cast<std::size_t>(width) + kLaneNumbers.size()), screen_x(x.size()), depth(x.size()),
      environment(x.size()) {
    for (auto *arrays : {&normal, &colour, &tint})
        for (std::vector<float> &array : *arrays)
            array.resize(x.size());
    for (std::vector<float> &array : phong)
        array.resize(x.size());
    for (std::vector<float> &array : lit)
        array.resize(x.size());
}

std::vector<EyeLight> lights_in_eye_space(std::span<const Light> lights, double grid_edge,
                                          const Projection &projection) {
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
