#include "pbm_build/voxels/sample_points.h"

#include "pbm_build/lattice/lattice_triangle.h"
#include "pbm_build/voxels/triangle_voxels.h"
#include "pbm_scan/surface/refusal.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <mutex>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096;

int largest_axis(const glm::dvec3 &n) {
    const double x = std::fabs(n.x), y = std::fabs(n.y), z = std::fabs(n.z);
    return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

} // namespace

MortonCode SurfaceSampler::first_voxel(std::size_t i) const {
    return code_of(voxel_of(lattice_[is_triangle(i) ? surface_.triangles[i].x : vertex_of_point(i)]));
}

bool SurfaceSampler::may_touch(std::size_t i, MortonCode first, MortonCode last) const {
    glm::ivec3 low, high; // a box has no codes below its lowest corner's, and none above its highest one's
    if (is_triangle(i)) {
        const glm::uvec3 &t = surface_.triangles[i];
        const LatticePoint &a = lattice_[t.x], &b = lattice_[t.y], &c = lattice_[t.z];
        low = voxel_of(glm::min(a, glm::min(b, c)));
        high = voxel_of(glm::max(a, glm::max(b, c)));
    } else {
        low = high = voxel_of(lattice_[vertex_of_point(i)]);
    }
    return code_of(high) >= first && code_of(low) < last;
}

void SurfaceSampler::find_hits(std::size_t i, int writer, HitStore &store, SmallTriangleCodes &codes) const {
    const auto source = static_cast<std::uint32_t>(i);
    if (!is_triangle(i)) {
        store.add(writer, code_of(voxel_of(lattice_[vertex_of_point(i)])), source);
        return;
    }
    constexpr std::size_t kAhead = 16;
    if (is_triangle(i + kAhead))
        for (int corner = 0; corner < 3; ++corner)
            __builtin_prefetch(&lattice_[surface_.triangles[i + kAhead][corner]]);
    const glm::uvec3 &t = surface_.triangles[i];
    std::array<LatticePoint, 3> corners{lattice_[t.x], lattice_[t.y], lattice_[t.z]};
    const glm::ivec3 voxel = voxel_of(corners[0]);
    if (voxel == voxel_of(corners[1]) && voxel == voxel_of(corners[2])) {
        store.add(writer, code_of(voxel), source);
        return;
    }
    const glm::dvec3 normal = lattice_normal(corners[0], corners[1], corners[2]);
    const int depth_axis = largest_axis(normal);
    if (const std::size_t count = find_small_triangle(corners, normal, depth_axis, codes); count > 0) {
        store.add(writer, {codes.data(), count}, source);
        return;
    }
    sort_three(corners, before<LatticePoint>); // the cuts must not depend on the order of the corners
    visit_voxels({in_voxels(corners[0]), in_voxels(corners[1]), in_voxels(corners[2])}, depth_axis,
                 [&](MortonCode code) { store.add(writer, code, source); });
}

SurfaceSampler::Corner SurfaceSampler::corner(std::size_t vertex) const {
    Corner c{.at = lattice_[vertex], .attributes = {.normal = normals_.normals[vertex]}};
    if (!surface_.colours.empty())
        c.attributes.colour = linear_colour(surface_.colours[vertex]);
    if (!surface_.material_ids.empty())
        c.attributes.rest.material = surface_.material_ids[vertex];
    if (!radii_.empty())
        c.attributes.rest.radius = radii_[vertex];
    if (!surface_.two_sided.empty())
        c.attributes.rest.two_sided = surface_.two_sided[vertex] != 0;
    return c;
}

Status sample_points(const SurfaceSampler &sampler, HitStore &store, const BucketRange &range,
                     const std::function<void(double)> &progress) {
    const std::size_t count = sampler.source_count();
    if (count > kMaxSources)
        return too_large(std::to_string(count) + " triangles or points, the limit is 2^31: split the scan");
    std::atomic<std::size_t> next{0};
    std::mutex progress_mutex;
    const auto writers = static_cast<std::size_t>(store.writers());
    const bool is_part = range.first > 0 || range.last < store.bucket_count();
    const MortonCode first = MortonCode{range.first} << store.local_bits(),
                     last = MortonCode{range.last} << store.local_bits();
    parallel_for(writers, store.writers(), [&](std::size_t writer) {
        SmallTriangleCodes codes;
        for (std::size_t begin = next.fetch_add(kBlock); begin < count && !store.full();
             begin = next.fetch_add(kBlock)) {
            for (std::size_t i = begin; i < std::min(begin + kBlock, count) && !store.full(); ++i)
                if (!is_part || sampler.may_touch(i, first, last))
                    sampler.find_hits(i, static_cast<int>(writer), store, codes);
            if (progress && progress_mutex.try_lock()) {
                const std::lock_guard lock(progress_mutex, std::adopt_lock);
                progress(static_cast<double>(begin) / static_cast<double>(count));
            }
        }
    });
    if (store.size() > store.max_hits())
        return out_of_memory("more than " + std::to_string(store.max_hits()) +
                             " samples, the limit; choose a smaller --depth, or --max-points");
    return {};
}

} // namespace pbm::build
