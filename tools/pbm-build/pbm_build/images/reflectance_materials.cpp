#include "pbm_build/images/reflectance_materials.h"

#include "pbm_build/images/surface_looks.h"
#include "pbm_scan/conventions/reflectance.h"
#include "pbm_scan/text/printable.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace pbm::build {
namespace {

constexpr std::int64_t kFine = 16; // steps of a centre in one of a texel
// Of squared differences. The reflection of what is no metal changes a material less, ambient light too.
constexpr std::array<std::int64_t, kLookParts> kImportance{16, 16, 1, 16, 4};
constexpr std::int64_t kAllImportance = 16;

using Centre = std::array<std::int64_t, kLookParts>; // in 1 / kFine of a texel's steps

struct Spot {
    Centre at{};
    std::uint64_t weight = 0;
};

// The material that a centre stands for. `tints`: metals do.
Material material_at(const Centre &centre, bool tints, Material material) {
    const auto share = [&](std::size_t c) { return static_cast<double>(centre[c]) / (255.0 * kFine); };
    const double smooth = 1 - share(0);
    const auto of_smooth = [&](std::size_t c) { return smooth > 0 ? std::min(share(c) / smooth, 1.0) : 0; };
    set_reflectance({share(0), of_smooth(1), of_smooth(2), tints}, material);
    const double emitted = share(3), ambient = 1 - share(4);
    material.ka = static_cast<float>(emitted + (1 - emitted) * static_cast<double>(material.ka) * ambient);
    material.kd = static_cast<float>((1 - emitted) * static_cast<double>(material.kd));
    return material;
}

std::uint64_t squared_distance(const Centre &a, const Centre &b) {
    std::int64_t sum = 0;
    for (std::size_t c = 0; c < kLookParts; ++c)
        sum += kImportance[c] * (a[c] - b[c]) * (a[c] - b[c]);
    return static_cast<std::uint64_t>(sum / kAllImportance);
}

std::size_t nearest(const std::vector<Centre> &centres, const Centre &at) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < centres.size(); ++i)
        if (squared_distance(centres[i], at) < squared_distance(centres[best], at))
            best = i;
    return best;
}

// Their weights are below 2^32 together, so that sums of squares fit.
std::vector<Spot> spots_of(const std::vector<LookSums> &cells) {
    std::uint64_t all = 0;
    for (const LookSums &cell : cells)
        all += cell.weight;
    int shift = 0;
    while (all >> shift >= std::uint64_t{1} << 31)
        ++shift;
    std::vector<Spot> spots;
    for (const LookSums &cell : cells) {
        Spot spot{.weight = std::max<std::uint64_t>(cell.weight >> shift, 1)};
        for (std::size_t c = 0; c < kLookParts; ++c)
            spot.at[c] = static_cast<std::int64_t>(std::min<std::uint64_t>(
                (cell.parts[c] / cell.weight) * kFine + (cell.parts[c] % cell.weight) * kFine / cell.weight,
                255 * kFine));
        spots.push_back(spot);
    }
    return spots;
}

// Moves the centres to the means of the spots that are nearest to them, until they stay.
void settle(std::span<const Spot> spots, std::vector<Centre> &centres) {
    constexpr int kMaxRounds = 32;
    for (int round = 0; round < kMaxRounds; ++round) {
        std::vector<LookSums> sums(centres.size());
        for (const Spot &spot : spots) {
            LookSums &to = sums[nearest(centres, spot.at)];
            to.weight += spot.weight;
            for (std::size_t c = 0; c < kLookParts; ++c)
                to.parts[c] += spot.weight * static_cast<std::uint64_t>(spot.at[c]);
        }
        const std::vector<Centre> before = centres;
        for (std::size_t i = 0; i < centres.size(); ++i)
            for (std::size_t c = 0; c < kLookParts && sums[i].weight > 0; ++c)
                centres[i][c] = static_cast<std::int64_t>((sums[i].parts[c] + sums[i].weight / 2) / sums[i].weight);
        if (centres == before)
            return;
    }
}

// The root of the mean square of distances, 0..1, and the spot that adds most to it.
struct Misfit {
    double error = 0;
    Centre worst{};
};
Misfit misfit_of(std::span<const Spot> spots, const std::vector<Centre> &centres) {
    std::uint64_t all = 0, sum = 0, most = 0;
    Misfit misfit;
    for (const Spot &spot : spots) {
        const std::uint64_t square = spot.weight * squared_distance(spot.at, centres[nearest(centres, spot.at)]);
        all += spot.weight;
        sum += square;
        if (square > most) {
            most = square;
            misfit.worst = spot.at;
        }
    }
    misfit.error = std::sqrt(static_cast<double>(sum) / static_cast<double>(all)) / (255.0 * kFine);
    return misfit;
}

// As few centres as fit, at most `max_count`; sorted.
std::vector<Centre> centres_of(std::span<const Spot> spots, std::size_t max_count, double &error) {
    constexpr double kGoodEnough = 0.02;
    std::vector<Centre> centres{Centre{}};
    for (;;) {
        settle(spots, centres);
        const Misfit misfit = misfit_of(spots, centres);
        error = misfit.error;
        if (error <= kGoodEnough || centres.size() == max_count)
            break;
        centres.push_back(misfit.worst);
    }
    std::sort(centres.begin(), centres.end());
    return centres;
}

// The number of a material in `materials`, to which it is added if it is new.
std::uint8_t number_of(const Material &material, std::vector<Material> &materials) {
    const auto found = std::find(materials.begin(), materials.end(), material);
    const auto number = static_cast<std::uint8_t>(found - materials.begin());
    if (found == materials.end())
        materials.push_back(material);
    return number;
}

// The materials without reflectance, the first ones, at most `max_count`; without their colours, which points have.
std::vector<Material> fixed_materials(const Surface &surface, const Material &usual, std::size_t max_count) {
    std::vector<Material> fixed;
    for (std::size_t i = 0; i < surface.materials.size() && fixed.size() < max_count; ++i)
        if (i >= surface.reflectances.size() || !surface.reflectances[i]) {
            Material material = surface.materials[i];
            material.colour = usual.colour;
            number_of(material, fixed);
        }
    return fixed;
}

// [cells] the number of the material that is nearest to the middle of each.
std::vector<std::uint8_t> materials_of_cells(const std::vector<Centre> &centres,
                                             const std::vector<std::uint8_t> &numbers, std::size_t cells, int threads) {
    std::vector<std::uint8_t> of_cell(cells);
    constexpr std::size_t kBlock = 4096;
    parallel_for(cells, kBlock, threads, [&](std::size_t cell) {
        const auto middle = [&](int shift) {
            return (static_cast<std::int64_t>(cell >> shift & 31) * 8 + 4) * kFine - kFine / 2;
        };
        const auto step = [&](int shift) {
            return static_cast<std::int64_t>(cell >> shift & kLastStep) * 255 * kFine / kLastStep;
        };
        of_cell[cell] = numbers[nearest(
            centres, {middle(10), middle(5), middle(0), step(kReflectanceBits), step(kReflectanceBits + kStepBits)})];
    });
    return of_cell;
}

// Whether the colours of all metals are those of the surface.
bool do_metals_tint(const Surface &surface) {
    return std::all_of(surface.textures.begin(), surface.textures.end(),
                       [](const Texture &image) { return image.use.factors.tints; }) &&
           std::all_of(surface.reflectances.begin(), surface.reflectances.end(),
                       [](const auto &reflectance) { return !reflectance || reflectance->tints; });
}

// What the materials of a surface come from.
std::string sources_of(const Surface &surface) {
    std::vector<std::string> sources{"roughness", "metal"};
    if (!surface.layer(Layer::emission).ids.empty())
        sources.emplace_back("emission");
    if (!surface.layer(Layer::occlusion).ids.empty())
        sources.emplace_back("occlusion");
    return enumerated(sources);
}

} // namespace

void drop_reflectances(Surface &surface) {
    for (const Layer layer : {Layer::reflectance, Layer::emission, Layer::occlusion})
        surface.layer(layer) = {};
    surface.reflectances.clear();
    for (Texture &texture : surface.textures)
        if (texture.use.content != ImageContent::colours && texture.use.content != ImageContent::normals)
            texture = {};
}

void choose_reflectances(Surface &surface, const Material &usual, std::size_t max_materials, int threads,
                         BuildStatistics &statistics) {
    if (surface.layer(Layer::reflectance).ids.empty())
        return;
    const std::vector<Spot> spots = spots_of(sum_looks(surface, threads));
    if (spots.empty())
        return drop_reflectances(surface);
    if (surface.materials.empty())
        surface.materials = {usual};
    Material base = surface.materials.front();
    base.ka = usual.ka;
    base.kd = usual.kd;
    const std::vector<Material> fixed = fixed_materials(surface, base, max_materials / 2);
    double error = 0;
    const std::vector<Centre> centres = centres_of(spots, max_materials - fixed.size(), error);
    const bool tints = do_metals_tint(surface);
    std::vector<Material> materials;
    std::vector<std::uint8_t> of_centre;
    of_centre.reserve(centres.size());
    for (const Centre &centre : centres)
        of_centre.push_back(number_of(material_at(centre, tints, base), materials));
    surface.material_of_cell = materials_of_cells(
        centres, of_centre, has_more_than_reflectance(surface) ? kLookCells : kReflectanceCells, threads);
    std::vector<std::uint8_t> new_id;
    for (std::size_t i = 0; i < surface.materials.size(); ++i) {
        if (i < surface.reflectances.size() && surface.reflectances[i]) {
            const LookTexel look = reflecting(texel_of(*surface.reflectances[i]));
            new_id.push_back(surface.material_of_cell[look_cell(look_of(look))]);
            continue;
        }
        Material material = surface.materials[i];
        material.colour = base.colour;
        const auto kept = std::find(fixed.begin(), fixed.end(), material);
        new_id.push_back(number_of(kept == fixed.end() ? fixed.back() : material, materials));
    }
    if (surface.material_ids.empty())
        surface.material_ids.assign(surface.positions.size(), 0);
    for (std::uint8_t &id : surface.material_ids)
        id = new_id[id];
    surface.materials = std::move(materials);
    statistics.report("materials", Fate::converted,
                      counted(surface.materials.size(), "material") + " of images of " + sources_of(surface) + ", " +
                          formatted("%.1f %% from them (root of the mean square)", 100 * error));
    if (surface.materials.size() == 1)
        surface.material_ids.clear();
    // Emission is part of the colours, also where all points emit the same share of them.
    if (surface.materials.size() == 1 && surface.layer(Layer::emission).ids.empty()) {
        surface.material_of_cell.clear();
        drop_reflectances(surface);
    }
    surface.reflectances.clear();
}

} // namespace pbm::build
