#include "pbm_build/neighbourhoods/neighbourhoods.h"

#include "system/free_memory.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdlib>

namespace pbm::build {
namespace {

constexpr std::size_t kAgreementBlock = 4096;
constexpr double kScattered = 0.25;     // minimum of the mean roughness
constexpr double kAgreement = 0.95;     // of the planes of a noisy surface: mean cosine between neighbours
constexpr float kMeanReflection = 0.5F; // of a light by a white point, over all directions of its normal

// Mean of |cosine| between the normal of a point and those of its neighbours, x 32,767.
std::int64_t agreement(std::span<const std::uint32_t> nearest, std::span<const ShortNormal> normals,
                       std::size_t point) {
    std::int64_t sum = 0;
    for (const std::uint32_t neighbour : nearest)
        sum += std::abs(dot(normals[point], normals[neighbour]));
    return sum / (std::int64_t{32767} * static_cast<std::int64_t>(nearest.size()));
}

} // namespace

std::vector<Neighbourhood> classify(std::span<const std::uint32_t> nearest, std::size_t links,
                                    std::span<const Spread> spreads, std::span<const ShortNormal> normals,
                                    int threads) {
    const std::size_t count = spreads.size();
    const auto around = [&](std::size_t point) { return nearest.subspan(links * point, links); };
    const auto votes = static_cast<std::int64_t>(links) + 1;
    const auto least = static_cast<std::int64_t>(kScattered * 255) * votes;
    std::vector<Neighbourhood> neighbourhoods(count, Neighbourhood::planar);
    parallel_for(count, kAgreementBlock, threads, [&](std::size_t i) {
        std::int64_t roughness = spreads[i].roughness;
        for (const std::uint32_t neighbour : around(i))
            roughness += spreads[neighbour].roughness;
        neighbourhoods[i] = spreads[i].is_line   ? Neighbourhood::linear
                            : roughness >= least ? Neighbourhood::scattered
                                                 : Neighbourhood::planar;
    });
    const auto most = static_cast<std::int64_t>(kAgreement * 32767) * votes;
    parallel_for(count, kAgreementBlock, threads, [&](std::size_t i) {
        if (neighbourhoods[i] != Neighbourhood::scattered)
            return;
        std::int64_t agreements = agreement(around(i), normals, i);
        for (const std::uint32_t neighbour : around(i))
            agreements += agreement(around(neighbour), normals, neighbour);
        if (agreements >= most)
            neighbourhoods[i] = Neighbourhood::planar;
    });
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
