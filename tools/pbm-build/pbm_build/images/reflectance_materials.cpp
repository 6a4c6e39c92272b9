#include "pbm_build/images/reflectance_materials.h"

#include "pbm_build/images/texture_pyramid.h"
#include "pbm_scan/conventions/reflectance.h"
#include "pbm_scan/text/printable.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace pbm::build {
namespace {

constexpr std::int32_t kByteStep = 257; // 65,535 / 255
constexpr std::int64_t kFine = 16;      // steps of a centre in one of a texel
// Of squared differences. The reflection of what is no metal changes a material less.
constexpr std::array<std::int64_t, 3> kImportance{16, 16, 1};
constexpr std::int64_t kAllImportance = 16;

using Centre = std::array<std::int64_t, 3>; // in 1 / kFine of a texel's steps

// What a surface shows of a cell. Integers, so that no order matters.
struct CellSums {
    std::uint64_t weight = 0;
    std::array<std::uint64_t, 3> texels{};

    void add(const ReflectanceTexel &texel, std::uint64_t count) {
        weight += count;
        for (std::size_t c = 0; c < 3; ++c)
            texels[c] += count * texel[c];
    }
};

struct Spot {
    Centre at{};
    std::uint64_t weight = 0;
};

std::size_t cell_of(const ReflectanceTexel &texel) {
    return reflectance_cell({texel[0] * kByteStep, texel[1] * kByteStep, texel[2] * kByteStep});
}

// The material that a centre stands for.
Material material_at(const Centre &centre, Material material) {
    const auto share = [&](std::size_t c) { return static_cast<double>(centre[c]) / (255.0 * kFine); };
    const double smooth = 1 - share(0);
    const auto of_smooth = [&](std::size_t c) { return smooth > 0 ? std::min(share(c) / smooth, 1.0) : 0; };
    set_reflectance({share(0), of_smooth(1), of_smooth(2)}, material);
    return material;
}

std::uint64_t squared_distance(const Centre &a, const Centre &b) {
    std::int64_t sum = 0;
    for (std::size_t c = 0; c < 3; ++c)
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

// Areas of triangles in 2^-36 of the squared diagonal of the surface.
class Areas {
  public:
    explicit Areas(const Surface &surface) : surface_(surface) {
        glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
        for (const glm::dvec3 &p : surface.positions) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
        const glm::dvec3 diagonal = high - low;
        scale_ = std::ldexp(1 / glm::dot(diagonal, diagonal), 36);
    }
    // At least 1.
    std::uint64_t of(std::size_t triangle) const {
        const glm::uvec3 &t = surface_.triangles[triangle];
        std::array<glm::dvec3, 3> p{surface_.positions[t.x], surface_.positions[t.y], surface_.positions[t.z]};
        std::sort(p.begin(), p.end(),
                  [](const glm::dvec3 &a, const glm::dvec3 &b) { // which corner is first, says nothing
                      return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
                  });
        const double area = scale_ * glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) / 2;
        return area >= 1 && area < 0x1p40 ? static_cast<std::uint64_t>(area) : 1;
    }

  private:
    const Surface &surface_;
    double scale_;
};

std::vector<CellSums> sum_cells(const Surface &surface, int threads) {
    std::vector<CellSums> cells(kReflectanceCells);
    const std::vector<std::uint16_t> &ids = surface.layer(Layer::reflectance).ids;
    std::vector<std::uint64_t> area_of(surface.textures.size(), 0);
    const Areas areas(surface);
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        if (i < ids.size() && ids[i] != Surface::kNoTexture) {
            area_of[ids[i]] += areas.of(i);
            continue;
        }
        const std::size_t material = surface.material_ids.empty() ? 0 : surface.material_ids[surface.triangles[i].x];
        if (material < surface.reflectances.size() && surface.reflectances[material]) {
            const ReflectanceTexel texel = texel_of(*surface.reflectances[material]);
            cells[cell_of(texel)].add(texel, areas.of(i));
        }
    }
    const std::vector<TextureCoverage> coverages = covered_texels(surface, threads);
    for (std::size_t k = 0; k < area_of.size(); ++k) {
        const auto &texels = surface.textures[k].texels;
        std::uint64_t covered = 0;
        for (std::size_t i = 0; area_of[k] > 0 && i < texels.size(); ++i)
            covered += coverages[k].covers(i) ? 1U : 0U;
        const std::uint64_t weight = covered > 0 ? std::max<std::uint64_t>(area_of[k] / covered, 1) : 0;
        for (std::size_t i = 0; weight > 0 && i < texels.size(); ++i)
            if (const ReflectanceTexel texel{texels[i][0], texels[i][1], texels[i][2]}; coverages[k].covers(i))
                cells[cell_of(texel)].add(texel, weight);
    }
    return cells;
}

// Their weights are below 2^32 together, so that sums of squares fit.
std::vector<Spot> spots_of(const std::vector<CellSums> &cells) {
    std::uint64_t all = 0;
    for (const CellSums &cell : cells)
        all += cell.weight;
    int shift = 0;
    while (all >> shift >= std::uint64_t{1} << 31)
        ++shift;
    std::vector<Spot> spots;
    for (const CellSums &cell : cells) {
        if (cell.weight == 0)
            continue;
        Spot spot{.weight = std::max<std::uint64_t>(cell.weight >> shift, 1)};
        for (std::size_t c = 0; c < 3; ++c)
            spot.at[c] = static_cast<std::int64_t>(std::min<std::uint64_t>(
                (cell.texels[c] / cell.weight) * kFine + (cell.texels[c] % cell.weight) * kFine / cell.weight,
                255 * kFine));
        spots.push_back(spot);
    }
    return spots;
}

// Moves the centres to the means of the spots that are nearest to them, until they stay.
void settle(std::span<const Spot> spots, std::vector<Centre> &centres) {
    constexpr int kMaxRounds = 32;
    for (int round = 0; round < kMaxRounds; ++round) {
        std::vector<CellSums> sums(centres.size());
        for (const Spot &spot : spots) {
            CellSums &to = sums[nearest(centres, spot.at)];
            to.weight += spot.weight;
            for (std::size_t c = 0; c < 3; ++c)
                to.texels[c] += spot.weight * static_cast<std::uint64_t>(spot.at[c]);
        }
        const std::vector<Centre> before = centres;
        for (std::size_t i = 0; i < centres.size(); ++i)
            for (std::size_t c = 0; c < 3 && sums[i].weight > 0; ++c)
                centres[i][c] = static_cast<std::int64_t>((sums[i].texels[c] + sums[i].weight / 2) / sums[i].weight);
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

} // namespace

void drop_reflectances(Surface &surface) {
    surface.layer(Layer::reflectance) = {};
    surface.reflectances.clear();
    for (Texture &texture : surface.textures)
        if (texture.use.content == ImageContent::reflectance)
            texture = {};
}

void choose_reflectances(Surface &surface, const Material &usual, std::size_t max_materials, int threads,
                         BuildStatistics &statistics) {
    if (surface.layer(Layer::reflectance).ids.empty())
        return;
    const std::vector<Spot> spots = spots_of(sum_cells(surface, threads));
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
    std::vector<Material> materials;
    std::vector<std::uint8_t> of_centre;
    of_centre.reserve(centres.size());
    for (const Centre &centre : centres)
        of_centre.push_back(number_of(material_at(centre, base), materials));
    surface.material_of_cell.resize(kReflectanceCells);
    for (std::size_t cell = 0; cell < kReflectanceCells; ++cell) {
        const auto middle = [&](int shift) {
            return (static_cast<std::int64_t>(cell >> shift & 31) * 8 + 4) * kFine - kFine / 2;
        };
        surface.material_of_cell[cell] = of_centre[nearest(centres, {middle(10), middle(5), middle(0)})];
    }
    std::vector<std::uint8_t> new_id;
    for (std::size_t i = 0; i < surface.materials.size(); ++i) {
        if (i < surface.reflectances.size() && surface.reflectances[i]) {
            new_id.push_back(surface.material_of_cell[cell_of(texel_of(*surface.reflectances[i]))]);
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
                      counted(surface.materials.size(), "material") + " of images of roughness and metal, " +
                          formatted("%.1f %% from them (root of the mean square)", 100 * error));
    if (surface.materials.size() == 1) {
        surface.material_ids.clear();
        surface.material_of_cell.clear();
        drop_reflectances(surface);
    }
    surface.reflectances.clear();
}

} // namespace pbm::build
