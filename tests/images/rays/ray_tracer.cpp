#include "ray_tracer.h"

#include "system/threads/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

// Distance from the surface to the start of a shadow ray, in edges of the cube.
constexpr double kOffSurface = 1e-5;

glm::dvec3 colour_of(const Rgb8 &srgb) { return {to_linear(srgb[0]), to_linear(srgb[1]), to_linear(srgb[2])}; }

template <class T> glm::dvec3 mixed(std::span<const T> of_vertices, const glm::uvec3 &t, const glm::dvec3 &weights) {
    return weights.x * glm::dvec3(of_vertices[t.x]) + weights.y * glm::dvec3(of_vertices[t.y]) +
           weights.z * glm::dvec3(of_vertices[t.z]);
}

glm::dvec3 vector_of(const std::array<float, 3> &v) { return {v[0], v[1], v[2]}; }

// Direction and strength of a light at a place.
struct Incidence {
    glm::dvec3 to_light; // unit vector
    double distance;
    double strength; // of a spot light, depends on the angle
};

Incidence incidence(const TracedScene &scene, const Light &light, const glm::dvec3 &place) {
    if (light.kind == LightKind::directional)
        return {-glm::normalize(vector_of(light.direction)), std::numeric_limits<double>::infinity(), 1};
    const glm::dvec3 way = scene.light_origin + vector_of(light.position) - place;
    const double distance = glm::length(way);
    const glm::dvec3 to_light = way / distance;
    if (light.kind == LightKind::point)
        return {to_light, distance, 1};
    const double cosine = -glm::dot(to_light, vector_of(light.direction));
    return {to_light, distance, cosine > 0 ? std::pow(cosine, static_cast<double>(light.exponent)) : 0};
}

// The R2 sequence: points of a square, evenly spread for any number of them.
// Based on: Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018
std::vector<glm::dvec2> sample_positions(int samples) {
    constexpr double kPlastic = 1.32471795724474602596;
    std::vector<glm::dvec2> positions{{0.5, 0.5}};
    for (int i = 1; i < samples; ++i)
        positions.emplace_back(std::fmod(0.5 + i / kPlastic, 1.0), std::fmod(0.5 + i / (kPlastic * kPlastic), 1.0));
    return positions;
}

} // namespace

glm::dvec3 reflected_light(const TracedScene &scene, const glm::dvec3 &eye, const glm::dvec3 &direction,
                           const RayHit &hit) {
    const glm::uvec3 &t = scene.mesh.triangles[hit.triangle];
    const SurfaceLook &look = scene.look;
    const std::array<glm::vec3, 3> &normals = look.normals[hit.triangle];
    const bool is_back = glm::dot(glm::dvec3(hit.face), direction) > 0;
    const glm::dvec3 smooth =
        glm::normalize(normals[0] * hit.weights.x + normals[1] * hit.weights.y + normals[2] * hit.weights.z);
    const glm::dvec3 front = look.relief ? look.relief(hit.triangle, hit.weights, smooth) : smooth;
    const glm::dvec3 normal = is_back && scene.shows_backs ? -front : front;
    const int nearest = hit.weights.x >= hit.weights.y ? (hit.weights.x >= hit.weights.z ? 0 : 2)
                                                       : (hit.weights.y >= hit.weights.z ? 1 : 2);
    const Material &material = scene.materials[look.materials.empty() ? 0 : look.materials[t[nearest]]];
    const auto of_image = look.image ? look.image(hit.triangle, hit.weights) : std::nullopt;
    const glm::dvec3 colour = of_image               ? *of_image
                              : look.colours.empty() ? colour_of(material.colour)
                                                     : mixed<glm::vec3>(look.colours, t, hit.weights);

    const glm::dvec3 place = eye + static_cast<double>(hit.distance) * direction;
    const glm::dvec3 to_eye = -glm::normalize(direction);
    const glm::dvec3 outside = is_back ? -hit.face : hit.face;
    glm::dvec3 light(material.ka);
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        const Light &source = scene.lights[i];
        const Incidence from = incidence(scene, source, place);
        const double cosine = glm::dot(normal, from.to_light);
        if (cosine <= 0 || from.strength <= 0)
            continue;
        if (i < static_cast<std::size_t>(scene.shadowed) &&
            scene.rays.is_blocked(place + kOffSurface * scene.edge * outside, from.to_light, from.distance))
            continue;
        const glm::dvec3 mirrored = 2 * cosine * normal - from.to_light;
        const double shine = std::max(glm::dot(mirrored, to_eye), 0.0);
        const double specular = shine > 0 ? std::pow(shine, static_cast<double>(material.power)) : 0;
        light += from.strength * (material.kd * cosine + material.ks * specular) * vector_of(source.intensity);
    }
    return colour * light;
}

std::vector<Srgb> trace(const TracedScene &scene, const Camera &camera, int width, int height, int samples,
                        int threads) {
    const PixelRays rays(camera, width, height);
    const std::vector<glm::dvec2> positions = sample_positions(samples);
    const glm::dvec3 background = colour_of(scene.background);
    std::vector<Srgb> picture(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    parallel_for(static_cast<std::size_t>(height), threads, [&](std::size_t y) {
        for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
            glm::dvec3 sum(0);
            for (const glm::dvec2 &position : positions) {
                const glm::dvec3 direction =
                    rays.through(static_cast<double>(x) + position.x, static_cast<double>(y) + position.y);
                const auto hit = scene.rays.nearest(rays.eye, direction);
                sum += hit ? glm::clamp(reflected_light(scene, rays.eye, direction, *hit), 0.0, 1.0) : background;
            }
            Srgb &pixel = picture[y * static_cast<std::size_t>(width) + x];
            for (int channel = 0; channel < 3; ++channel)
                pixel[static_cast<std::size_t>(channel)] =
                    static_cast<std::uint8_t>(to_srgb(sum[channel] / samples) + 0.5);
        }
    });
    return picture;
}

} // namespace pbm
