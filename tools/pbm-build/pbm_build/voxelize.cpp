#include "pbm_build/voxelize.h"

#include "pbm_build/radix_sort.h"
#include "pbm_format/parallel.h"

#include <algorithm>
#include <memory>

namespace pbm::build {
namespace {

using NormalSum = std::array<std::int64_t, 3>;

double squared(const NormalSum &v) {
    const double x = static_cast<double>(v[0]), y = static_cast<double>(v[1]), z = static_cast<double>(v[2]);
    return (x * x + y * y) + z * z;
}

std::uint16_t quantise(const NormalSum &v) {
    return quantise_normal(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
}

// The normal of the plane that opposite normals share: all are turned to one side of the axis along which they are
// longest.
NormalSum plane_normal(std::span<const Sample *const> samples) {
    std::array<NormalSum, 3> columns{};
    for (const Sample *s : samples)
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t axis = 0; axis < 3; ++axis)
                columns[k][axis] += std::int64_t{s->normal[k]} * s->normal[axis];
    std::size_t longest = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (columns[k][k] > columns[longest][longest])
            longest = k;
    return columns[longest];
}

std::uint16_t average_normal(std::span<const Sample *const> samples) {
    NormalSum sum{};
    std::int64_t votes = 0, two_sided = 0;
    for (const Sample *s : samples) {
        votes += is_zero(s->normal) ? 0 : 1;
        two_sided += s->two_sided && !is_zero(s->normal) ? 1 : 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            sum[axis] += s->normal[axis];
    }
    if (votes == 0)
        return kNoNormal;
    const double half = kNormalScale / 2 * static_cast<double>(votes);
    if (squared(sum) >= half * half)
        return static_cast<std::uint16_t>(quantise(sum) | (2 * two_sided >= votes ? kTwoSidedBit : 0));
    return quantise(plane_normal(samples)) | kTwoSidedBit;
}

// The voxels of one bucket, whose first voxel is `first_code`. `hits` are not empty.
Voxels voxelize_bucket(const SurfaceSampler &sampler, std::vector<Hit> hits, MortonCode first_code, int local_bits,
                       const AttributeSet &set) {
    std::vector<Sample> samples;
    samples.reserve(hits.size());
    sampler.sample(hits, first_code, samples); // before sorting: here the hits of a triangle are neighbours
    for (std::size_t i = 0; i < hits.size(); ++i)
        hits[i] = local_code_of(hits[i]) << kSourceBits | i; // now [30..0] names the sample
    std::vector<Hit> spare;
    radix_sort(hits, spare, kSourceBits, local_bits);

    std::size_t count = 1;
    for (std::size_t i = 1; i < hits.size(); ++i)
        count += local_code_of(hits[i]) != local_code_of(hits[i - 1]) ? 1 : 0;
    Voxels voxels;
    voxels.codes.reserve(count);
    voxels.points.resize(count, set);
    std::vector<const Sample *> group;
    for (std::size_t i = 0; i < hits.size();) {
        const MortonCode code = local_code_of(hits[i]);
        group.clear();
        for (; i < hits.size() && local_code_of(hits[i]) == code; ++i)
            group.push_back(&samples[source_of(hits[i])]);
        const std::size_t point = voxels.codes.size();
        const VoxelAttributes average = average_samples(group);
        voxels.codes.push_back(first_code | code);
        voxels.points.normals[point] = average.normal;
        voxels.points.radii[point] = average.radius;
        if (set.colour != ColourFormat::none)
            set_point_colour(voxels.points, point, set.colour, average.colour);
        if (set.material)
            voxels.points.materials[point] = average.material;
    }
    return voxels;
}

template <class T> void copy_to(const std::vector<T> &from, std::vector<T> &to, std::size_t at) {
    std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(at));
}

} // namespace

VoxelAttributes average_samples(std::span<const Sample *const> samples) {
    const auto votes = static_cast<std::uint64_t>(samples.size());
    std::array<std::uint64_t, 3> colour{};
    std::array<std::uint64_t, kMaxMaterials> materials{};
    std::uint8_t radius = 0;
    for (const Sample *s : samples) {
        for (std::size_t c = 0; c < 3; ++c)
            colour[c] += s->colour[c];
        ++materials[s->material];
        radius = std::max(radius, s->radius);
    }
    VoxelAttributes average{};
    average.normal = average_normal(samples);
    for (std::size_t c = 0; c < 3; ++c)
        average.colour[c] = linear_to_srgb(static_cast<std::uint32_t>((2 * colour[c] + votes) / (2 * votes)));
    average.material =
        static_cast<std::uint8_t>(std::max_element(materials.begin(), materials.end()) - materials.begin());
    average.radius = radius;
    return average;
}

Voxels voxelize(const SurfaceSampler &sampler, HitStore &store, const AttributeSet &set, int threads) {
    std::vector<std::unique_ptr<Voxels>> buckets(store.bucket_count()); // null where the surface is not
    parallel_for(buckets.size(), threads, [&](std::size_t bucket) {
        std::vector<Hit> hits;
        store.take(bucket, hits);
        const MortonCode first_code = static_cast<MortonCode>(bucket) << store.local_bits();
        if (!hits.empty())
            buckets[bucket] = std::make_unique<Voxels>(
                voxelize_bucket(sampler, std::move(hits), first_code, store.local_bits(), set));
    });

    std::vector<std::size_t> starts(buckets.size() + 1, 0);
    for (std::size_t b = 0; b < buckets.size(); ++b)
        starts[b + 1] = starts[b] + (buckets[b] ? buckets[b]->codes.size() : 0);
    Voxels all;
    all.codes.resize(starts.back());
    all.points.resize(starts.back(), set);
    parallel_for(buckets.size(), threads, [&](std::size_t b) {
        const std::unique_ptr<Voxels> part = std::move(buckets[b]);
        if (!part)
            return;
        copy_to(part->codes, all.codes, starts[b]);
        copy_to(part->points.normals, all.points.normals, starts[b]);
        copy_to(part->points.radii, all.points.radii, starts[b]);
        copy_to(part->points.colours, all.points.colours, starts[b] * static_cast<std::size_t>(set.colour_bytes()));
        copy_to(part->points.materials, all.points.materials, set.material ? starts[b] : 0);
    });
    return all;
}

} // namespace pbm::build
