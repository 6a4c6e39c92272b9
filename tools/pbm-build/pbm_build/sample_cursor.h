// The attributes that a triangle or point lends to a voxel.
#pragma once

#include "pbm_build/sample_points.h"
#include "pbm_build/triangle_voxels.h"

namespace pbm::build {

// Samples of hits, one after the other, fastest where hits of one source are neighbours. For one thread.
class SampleCursor {
  public:
    explicit SampleCursor(const SurfaceSampler &sampler)
        : sampler_(sampler), triangle_count_(sampler.surface_.triangles.size()) {}

    // A sample whose normal is left to be rounded, with those of others (NormalColumns).
    struct Unrounded {
        Sample sample; // without its normal
        glm::dvec3 normal;
        bool is_rounded;
    };

    // The sample of `source` in a voxel that it passes through. Inline: a Sample that goes through memory is written in
    // twos of bytes and read in sixteens, which processors wait for.
    [[gnu::always_inline]] inline Unrounded at(std::uint32_t source, const glm::ivec3 &voxel) {
        if (source >= triangle_count_) {
            const Sample sample = sampler_.corner(sampler_.vertex_of_point(source)).attributes;
            return {sample, {sample.normal[0], sample.normal[1], sample.normal[2]}, true};
        }
        if (source != source_) {
            load(source);
            source_ = source;
        }
        const Triangle &t = triangle_;
        const std::array<double, 3> weights =
            t.in_one_voxel ? std::array{1.0 / 3, 1.0 / 3, 1.0 / 3} : t.nearest.weights(glm::dvec3(voxel) + 0.5);
        const Pair xy = weights[0] * t.values[0][0] + weights[1] * t.values[1][0] + weights[2] * t.values[2][0];
        const Pair z_red =
            Pair{0, 0.5} + weights[0] * t.values[0][1] + weights[1] * t.values[1][1] + weights[2] * t.values[2][1];
        const Pair green_blue =
            Pair{0.5, 0.5} + weights[0] * t.values[0][2] + weights[1] * t.values[1][2] + weights[2] * t.values[2][2];
        Sample mixed{.radius = t.radius, .two_sided = t.two_sided};
        const auto to_colour = [](double x) {
            return static_cast<std::uint16_t>(static_cast<int>(std::min(std::max(x, 0.0), 65535.0)));
        };
        mixed.colour = {to_colour(z_red[1]), to_colour(green_blue[0]), to_colour(green_blue[1])};
        mixed.material = t.materials[0];
        if (t.mixed_materials)
            mixed.material = t.materials[static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) -
                                                                  weights.begin())];
        if (t.crease)
            return {mixed, {t.flat[0], t.flat[1], t.flat[2]}, true};
        return {mixed, {xy[0], xy[1], z_red[0]}, false};
    }

  private:
    using Pair = double __attribute__((vector_size(16)));
    struct Triangle {
        NearestOnTriangle nearest;
        std::array<std::array<Pair, 3>, 3> values{}; // of the corners: normal x y, z red, green blue
        std::array<std::uint8_t, 3> materials{};
        ShortNormal flat{};  // of the plane; zero if there is none
        bool crease = false; // a corner's normal is too far from it
        bool in_one_voxel = false;
        bool mixed_materials = false;
        bool two_sided = false; // a corner is
        std::uint8_t radius = 0;
    };
    void load(std::uint32_t source);

    const SurfaceSampler &sampler_;
    std::size_t triangle_count_;
    std::uint64_t source_ = kMaxSources; // of triangle_; none
    Triangle triangle_;
};

} // namespace pbm::build
