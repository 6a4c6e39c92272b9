#include "pbm_build/sample_cursor.h"

#include "pbm_build/lattice_triangle.h"

#include <algorithm>
#include <tuple>

namespace pbm::build {
namespace {

// So thin that rounding to the lattice may turn its normal by more than a degree or two: under 64 steps high.
bool is_sliver(const glm::dvec3 &normal, const LatticePoint &a, const LatticePoint &b, const LatticePoint &c) {
    const auto squared = [](const glm::dvec3 &v) { return (v.x * v.x + v.y * v.y) + v.z * v.z; };
    const double longest =
        std::max({squared(glm::dvec3(b - a)), squared(glm::dvec3(c - b)), squared(glm::dvec3(a - c))});
    return squared(normal) <= 64.0 * 64.0 * longest;
}

// From 45 degrees on: the normal of a vertex on a right-angled edge is exactly that far from both faces, and rounding
// must not decide which of them keep their own. cosine^2 < 0.52 is 43.9 degrees.
bool across_crease(const ShortNormal &a, const ShortNormal &b) {
    const std::int64_t cosine = dot(a, b);
    return cosine <= 0 || static_cast<double>(cosine) * static_cast<double>(cosine) <
                              0.52 * static_cast<double>(dot(a, a)) * static_cast<double>(dot(b, b));
}

} // namespace

void SampleCursor::load(std::uint32_t source) {
    using Corner = SurfaceSampler::Corner;
    const glm::uvec3 &vertices = sampler_.surface_.triangles[source];
    std::array<Corner, 3> corners{sampler_.corner(vertices.x), sampler_.corner(vertices.y),
                                  sampler_.corner(vertices.z)};
    const glm::dvec3 facing = lattice_normal(corners[0].at, corners[1].at, corners[2].at);
    const bool sliver = is_sliver(facing, corners[0].at, corners[1].at, corners[2].at);
    std::array<const Corner *, 3> order{&corners[0], &corners[1], &corners[2]}; // not that of the file
    sort_three(order, [](const Corner *a, const Corner *b) {
        if (a->at != b->at)
            return before(a->at, b->at);
        const auto rest = [](const Sample &s) { return std::tie(s.normal, s.colour, s.material); };
        return rest(a->attributes) < rest(b->attributes);
    });
    Triangle &t = triangle_;
    t.nearest = NearestOnTriangle({in_voxels(order[0]->at), in_voxels(order[1]->at), in_voxels(order[2]->at)});
    t.flat = to_short_normal(sampler_.normals_.faces_point_inward ? -facing : facing);
    t.crease = t.two_sided = false;
    t.radius = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const Sample &attributes = order[c]->attributes;
        t.crease |= is_zero(attributes.normal) || (!sliver && across_crease(t.flat, attributes.normal));
        t.radius = std::max(t.radius, attributes.radius);
        t.two_sided |= attributes.two_sided;
        t.materials[c] = attributes.material;
        const auto &[x, y, z] = attributes.normal;
        const auto &[red, green, blue] = attributes.colour;
        t.values[c][0] = Pair{static_cast<double>(x), static_cast<double>(y)};
        t.values[c][1] = Pair{static_cast<double>(z), static_cast<double>(red)};
        t.values[c][2] = Pair{static_cast<double>(green), static_cast<double>(blue)};
    }
    t.mixed_materials = t.materials[1] != t.materials[0] || t.materials[2] != t.materials[0];
    const glm::ivec3 voxel = voxel_of(corners[0].at);
    t.in_one_voxel = voxel == voxel_of(corners[1].at) && voxel == voxel_of(corners[2].at);
}

} // namespace pbm::build
