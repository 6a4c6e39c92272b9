#include "pbm_build/neighbourhoods/neighbourhoods.h"

#include "system/free_memory.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <bitset>

namespace pbm::build {
namespace {

constexpr std::size_t kBlockOfCloud = 4096;
constexpr double kScattered = 0.13;     // minimum of the mean roughness
constexpr double kVeryRough = 0.25;     // a mean roughness that few points of a body have:
constexpr double kFewRough = 0.3;       // maximum share of them
constexpr float kMeanReflection = 0.5F; // of a light by a white point, over all directions of its normal

using Sums = std::vector<std::uint32_t>; // [points]

// Sums of the values of each point and its neighbours.
Sums pooled(std::span<const std::uint32_t> nearest, const Sums &values, int threads) {
    const std::size_t links = values.empty() ? 0 : nearest.size() / values.size();
    Sums sums = values;
    parallel_for(sums.size(), kBlockOfCloud, threads, [&](std::size_t i) {
        for (const std::uint32_t neighbour : nearest.subspan(links * i, links))
            sums[i] += values[neighbour];
    });
    return sums;
}

Sums values_of(std::span<const Spread> spreads, std::uint8_t Spread::*which) {
    Sums values;
    values.reserve(spreads.size());
    for (const Spread &spread : spreads)
        values.push_back(spread.*which);
    return values;
}

} // namespace

std::vector<Neighbourhood> classify(std::span<const std::uint32_t> nearest, std::size_t links,
                                    std::span<const Spread> spreads, bool looks_like_body, int threads) {
    std::vector<Neighbourhood> neighbourhoods(spreads.size(), Neighbourhood::planar);
    for (std::size_t i = 0; i < spreads.size(); ++i)
        if (spreads[i].is_line)
            neighbourhoods[i] = Neighbourhood::linear;
    const double summed = static_cast<double>(links) + 1;
    const Sums once = pooled(nearest, values_of(spreads, &Spread::roughness), threads);
    const auto very_rough = static_cast<double>(std::count_if(
        once.begin(), once.end(), [&](std::uint32_t roughness) { return roughness >= kVeryRough * 255 * summed; }));
    if (looks_like_body && very_rough <= kFewRough * static_cast<double>(spreads.size()))
        return neighbourhoods;
    const auto pooled_twice = [&](const Sums &values) {
        return pooled(nearest, pooled(nearest, values, threads), threads);
    };
    const Sums roughness = pooled(nearest, once, threads), at_few = pooled_twice(values_of(spreads, &Spread::at_few)),
               at_many = pooled_twice(values_of(spreads, &Spread::at_many));
    for (std::size_t i = 0; i < spreads.size(); ++i) {
        const bool is_rough = roughness[i] >= kScattered * 255 * summed * summed;
        const bool is_noise = 3 * at_many[i] < 2 * at_few[i];
        if (is_rough && !is_noise && !spreads[i].is_line)
            neighbourhoods[i] = Neighbourhood::scattered;
    }
    return neighbourhoods;
}

bool make_round(Surface &surface, std::span<const std::uint8_t> is_round) {
    const std::size_t first = surface.first_point();
    std::vector<std::uint8_t> ids;
    if (surface.materials.size() > 1)
        ids = surface.material_ids;
    ids.resize(surface.positions.size());
    std::vector<Material> materials = surface.materials;
    if (materials.empty())
        materials.resize(1);
    std::bitset<kMaxMaterials> of_round_points;
    for (std::size_t i = 0; i < is_round.size(); ++i)
        if (is_round[i] != 0)
            of_round_points.set(ids[first + i]);
    if (of_round_points.none())
        return true;
    if (materials.size() + of_round_points.count() > kMaxMaterials)
        return false;
    std::array<std::uint8_t, kMaxMaterials> copies{}; // in the order of the materials, not of the points
    for (std::size_t id = 0; id < copies.size(); ++id) {
        if (!of_round_points[id])
            continue;
        copies[id] = static_cast<std::uint8_t>(materials.size());
        Material round = materials[id];
        round.ka = std::min(round.ka + kMeanReflection * round.kd, 1.0F);
        round.kd = round.ks = round.environment = 0;
        round.shape = PointShape::round;
        materials.push_back(round);
    }
    for (std::size_t i = 0; i < is_round.size(); ++i)
        if (is_round[i] != 0)
            ids[first + i] = copies[ids[first + i]];
    surface.material_ids = std::move(ids);
    surface.materials = std::move(materials);
    return true;
}

void settle_round(Voxels &voxels, ModelParameters &parameters) {
    std::vector<Material> &materials = parameters.materials;
    Bytes &ids = voxels.points.materials;
    if (ids.empty() || std::none_of(materials.begin(), materials.end(), is_round))
        return;
    voxels.sides = {};
    std::array<std::uint8_t, kMaxMaterials> kept{}; // [material] its new index + 1; 0: no voxel has it
    for (std::size_t i = 0; i < ids.size(); ++i) {
        kept[ids[i]] = 1;
        if (is_round(materials[ids[i]]))
            voxels.points.normals[i] |= kTwoSidedBit;
    }
    std::vector<Material> used;
    for (std::size_t m = 0; m < materials.size(); ++m)
        if (kept[m] != 0) {
            used.push_back(materials[m]);
            kept[m] = static_cast<std::uint8_t>(used.size());
        }
    for (std::uint8_t &id : ids)
        id = static_cast<std::uint8_t>(kept[id] - 1);
    materials = std::move(used);
    parameters.attributes.material = materials.size() > 1;
    if (!parameters.attributes.material)
        free_memory(ids);
}

} // namespace pbm::build
