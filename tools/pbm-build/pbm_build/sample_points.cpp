#include "pbm_build/sample_points.h"

#include "pbm_format/parallel.h"

#include <algorithm>
#include <mutex>
#include <tuple>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096;

// Normal of a triangle from exact integers, outside where the corners run counter-clockwise; zero if it has no area.
glm::dvec3 lattice_normal(const LatticePoint &a, const LatticePoint &b, const LatticePoint &c) {
    const glm::i64vec3 u = glm::i64vec3(b) - glm::i64vec3(a), v = glm::i64vec3(c) - glm::i64vec3(a);
    return glm::dvec3(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
}

int largest_axis(const glm::dvec3 &n) {
    const double x = std::fabs(n.x), y = std::fabs(n.y), z = std::fabs(n.z);
    return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

bool before(const LatticePoint &a, const LatticePoint &b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

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

glm::dvec3 in_voxels(const LatticePoint &p) { return glm::dvec3(p) * (1 / kLatticeSteps); }

template <class T, class Less> void sort_three(std::array<T, 3> &items, Less less) {
    if (less(items[1], items[0]))
        std::swap(items[0], items[1]);
    if (less(items[2], items[1]))
        std::swap(items[1], items[2]);
    if (less(items[1], items[0]))
        std::swap(items[0], items[1]);
}

} // namespace

SurfaceSampler::SurfaceSampler(const Surface &surface, const VertexNormals &normals, const Bytes &radii,
                               const Grid &grid, int threads)
    : surface_(surface), normals_(normals), radii_(radii), lattice_(to_lattice(surface.positions, grid, threads)) {}

void SurfaceSampler::find_hits(std::size_t i, int writer, HitStore &store) const {
    const auto source = static_cast<std::uint32_t>(i);
    if (!is_triangle(i)) {
        store.add(writer, code_of(voxel_of(lattice_[vertex_of_point(i)])), source);
        return;
    }
    const glm::uvec3 &t = surface_.triangles[i];
    std::array<LatticePoint, 3> corners{lattice_[t.x], lattice_[t.y], lattice_[t.z]};
    const glm::ivec3 voxel = voxel_of(corners[0]);
    if (voxel == voxel_of(corners[1]) && voxel == voxel_of(corners[2])) {
        store.add(writer, code_of(voxel), source);
        return;
    }
    sort_three(corners, before); // cut in the same order whichever corner the file names first
    const int depth_axis = largest_axis(lattice_normal(corners[0], corners[1], corners[2]));
    visit_voxels({in_voxels(corners[0]), in_voxels(corners[1]), in_voxels(corners[2])}, depth_axis,
                 [&](MortonCode code) { store.add(writer, code, source); });
}

SurfaceSampler::Corner SurfaceSampler::corner(std::size_t vertex) const {
    Corner c{lattice_[vertex], {.normal = normals_.normals[vertex]}};
    if (!surface_.colours.empty())
        for (std::size_t channel = 0; channel < 3; ++channel)
            c.attributes.colour[channel] = linear_table()[surface_.colours[vertex][channel]];
    if (!surface_.material_ids.empty())
        c.attributes.material = surface_.material_ids[vertex];
    if (!radii_.empty())
        c.attributes.radius = radii_[vertex];
    if (!surface_.two_sided.empty())
        c.attributes.two_sided = surface_.two_sided[vertex] != 0;
    return c;
}

SampleCursor::Triangle SampleCursor::triangle(std::size_t i) const {
    using Corner = SurfaceSampler::Corner;
    const glm::uvec3 &vertices = sampler_.surface_.triangles[i];
    std::array<Corner, 3> corners{sampler_.corner(vertices.x), sampler_.corner(vertices.y),
                                  sampler_.corner(vertices.z)};
    const glm::dvec3 facing = lattice_normal(corners[0].at, corners[1].at, corners[2].at);
    const bool sliver = is_sliver(facing, corners[0].at, corners[1].at, corners[2].at);
    sort_three(corners, [](const Corner &a, const Corner &b) { // an order that does not depend on that of the file
        if (a.at != b.at)
            return before(a.at, b.at);
        const auto rest = [](const Sample &s) { return std::tie(s.normal, s.colour, s.material); };
        return rest(a.attributes) < rest(b.attributes);
    });
    Triangle t{.nearest =
                   NearestOnTriangle({in_voxels(corners[0].at), in_voxels(corners[1].at), in_voxels(corners[2].at)}),
               .values = {},
               .materials = {},
               .flat = to_short_normal(sampler_.normals_.faces_point_inward ? -facing : facing),
               .crease = false,
               .in_one_voxel = voxel_of(corners[0].at) == voxel_of(corners[1].at) &&
                               voxel_of(corners[0].at) == voxel_of(corners[2].at),
               .two_sided = false,
               .radius = 0};
    for (std::size_t c = 0; c < 3; ++c) {
        const Sample &attributes = corners[c].attributes;
        t.crease |= is_zero(attributes.normal) || (!sliver && across_crease(t.flat, attributes.normal));
        t.radius = std::max(t.radius, attributes.radius);
        t.two_sided |= attributes.two_sided;
        t.materials[c] = attributes.material;
        for (std::size_t k = 0; k < 3; ++k) {
            t.values[c][k] = attributes.normal[k];
            t.values[c][3 + k] = attributes.colour[k];
        }
    }
    return t;
}

Sample SampleCursor::at(std::uint32_t source, const glm::ivec3 &voxel) {
    if (!sampler_.is_triangle(source))
        return sampler_.corner(sampler_.vertex_of_point(source)).attributes;
    if (!triangle_ || source != source_) {
        triangle_.emplace(triangle(source));
        source_ = source;
    }
    const Triangle &t = *triangle_;
    const auto weights =
        t.in_one_voxel ? std::array{1.0 / 3, 1.0 / 3, 1.0 / 3} : t.nearest.weights(glm::dvec3(voxel) + 0.5);
    std::array<double, 6> sum{0, 0, 0, 0.5, 0.5, 0.5};
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < sum.size(); ++k)
            sum[k] += weights[c] * t.values[c][k];
    Sample mixed{.normal = t.flat, .radius = t.radius, .two_sided = t.two_sided};
    if (!t.crease)
        mixed.normal = to_short_normal({sum[0], sum[1], sum[2]});
    for (std::size_t k = 0; k < 3; ++k)
        mixed.colour[k] = static_cast<std::uint16_t>(std::clamp(sum[3 + k], 0.0, 65535.0));
    const auto heaviest = std::max_element(weights.begin(), weights.end()) - weights.begin();
    mixed.material = t.materials[static_cast<std::size_t>(heaviest)];
    return mixed;
}

Status sample_points(const SurfaceSampler &sampler, HitStore &store, const std::function<void(double)> &progress) {
    const std::size_t count = sampler.source_count();
    if (count > kMaxSources)
        return Error{ErrorCode::too_large, 0,
                     std::to_string(count) + " triangles or points, the limit is 2^31: split the scan"};
    std::atomic<std::size_t> next{0};
    std::mutex progress_mutex;
    const auto writers = static_cast<std::size_t>(store.writers());
    parallel_for(writers, store.writers(), [&](std::size_t writer) {
        for (std::size_t begin = next.fetch_add(kBlock); begin < count && !store.full();
             begin = next.fetch_add(kBlock)) {
            for (std::size_t i = begin; i < std::min(begin + kBlock, count) && !store.full(); ++i)
                sampler.find_hits(i, static_cast<int>(writer), store);
            if (progress && progress_mutex.try_lock()) {
                const std::lock_guard lock(progress_mutex, std::adopt_lock);
                progress(static_cast<double>(begin) / static_cast<double>(count));
            }
        }
    });
    if (store.full())
        return Error{ErrorCode::memory, 0,
                     "more than " + std::to_string(store.max_bytes() >> 20) +
                         " MiB are needed for the samples; choose a smaller --depth, or --max-points"};
    return {};
}

} // namespace pbm::build
