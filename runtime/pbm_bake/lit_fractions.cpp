#include "pbm_bake/lit_fractions.h"

#include "pbm_surface/carried_offsets.h"
#include "system/threads/parallel.h"

#include <algorithm>

namespace pbm {
namespace {

constexpr std::size_t kBricksAtOnce = 256;

// Sum and count of the lit fractions of those points below one node that the light faces.
struct LitSum {
    std::uint64_t sum = 0, count = 0;
    void add(const LitSum &other) {
        sum += other.sum;
        count += other.count;
    }
    std::uint8_t mean() const { return static_cast<std::uint8_t>((2 * sum + count) / (2 * count)); }
};

// Whether the light would reach a point if nothing were between them.
class FacingTest {
  public:
    FacingTest(const ShadowCasters &casters, const LightPlace &light) : casters_(casters), light_(light) {}

    bool faces(const LevelBrick &brick, std::size_t i) const {
        Vector3 travel = light_.direction;
        if (!light_.parallel) {
            travel = voxel_centre(brick, casters_.places()[i]);
            for (std::size_t axis = 0; axis < 3; ++axis)
                travel[axis] -= light_.position[axis];
            if (light_.spot && dot(travel, light_.direction) <= 0)
                return false;
        }
        return casters_.has_two_sides(i) || dot(normals_[casters_.normals()[i] & kNormalIndexMask], travel) < 0;
    }

  private:
    static double dot(const Vector3 &a, const Vector3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

    const ShadowCasters &casters_;
    const LightPlace &light_;
    std::span<const UnitVector> normals_ = normal_table();
};

// The value that a node inherits from the nodes above it, unless it has its own.
struct Given {
    std::uint8_t value = 0;
    Given below(const LitSum &sum) const { return sum.count > 0 ? Given{sum.mean()} : *this; }
};

struct BrickSums {
    std::array<LitSum, 64> pairs{}; // 2x2x2 voxels
    std::array<LitSum, 8> fours{};  // 4x4x4
    LitSum all;
};

BrickSums sum_brick(const ShadowCasters &casters, const FacingTest &test, std::size_t b,
                    std::span<const std::uint8_t> fractions) {
    const auto bricks = casters.bricks();
    BrickSums sums;
    for (std::size_t i = bricks[b].first_point; i < bricks[b + 1].first_point; ++i)
        if (test.faces(bricks[b], i))
            sums.pairs[casters.places()[i] >> 3U].add({fractions[i], 1});
    for (std::size_t i = 0; i < 64; ++i)
        sums.fours[i / 8].add(sums.pairs[i]);
    for (const LitSum &four : sums.fours)
        sums.all.add(four);
    return sums;
}

// The value that each brick inherits from the nodes above it.
std::vector<Given> given_to_bricks(std::span<const LevelBrick> bricks, std::vector<LitSum> sums) {
    struct Layer {
        std::vector<MortonCode> codes;
        std::vector<LitSum> sums;
    };
    std::vector<Layer> layers(1);
    for (const LevelBrick &brick : bricks)
        layers[0].codes.push_back(morton_encode(brick.corner[0], brick.corner[1], brick.corner[2]));
    layers[0].sums = std::move(sums);
    while (layers.back().codes.size() > 1) {
        const Layer &fine = layers.back();
        Layer coarse;
        for (std::size_t i = 0; i < fine.codes.size(); ++i) {
            if (coarse.codes.empty() || coarse.codes.back() != fine.codes[i] >> 3U) {
                coarse.codes.push_back(fine.codes[i] >> 3U);
                coarse.sums.emplace_back();
            }
            coarse.sums.back().add(fine.sums[i]);
        }
        layers.push_back(std::move(coarse));
    }
    std::vector<Given> given{Given{}.below(layers.back().sums[0])};
    for (std::size_t layer = layers.size() - 1; layer-- > 0;) {
        const Layer &fine = layers[layer], &coarse = layers[layer + 1];
        std::vector<Given> next(fine.codes.size());
        for (std::size_t i = 0, parent = 0; i < fine.codes.size(); ++i) {
            while (coarse.codes[parent] != fine.codes[i] >> 3U)
                ++parent;
            next[i] = given[parent].below(fine.sums[i]);
        }
        given = std::move(next);
    }
    return given;
}

} // namespace

std::pair<double, double> ray_in_texel(int i) {
    // Four axes of a low-discrepancy sequence; the sum of two uniform numbers has a tent distribution.
    constexpr std::array<std::uint32_t, 4> kSteps{3679390609U, 3152041523U, 2700274805U, 2313257605U};
    std::array<double, 4> at{};
    for (std::size_t axis = 0; axis < 4; ++axis)
        at[axis] = static_cast<double>(static_cast<std::uint32_t>(i + 1) * kSteps[axis]) * 0x1p-32;
    return {at[0] + at[1] - 0.5, at[2] + at[3] - 0.5};
}

void votes_to_fractions(std::span<std::uint8_t> votes, int maps, int bits) {
    const unsigned most = (1U << static_cast<unsigned>(bits)) - 1, all = static_cast<unsigned>(maps);
    std::array<std::uint8_t, 256> fraction{};
    for (unsigned i = 0; i < fraction.size(); ++i)
        fraction[i] = static_cast<std::uint8_t>((2 * std::min(i, all) * most + all) / (2 * all));
    for (std::uint8_t &vote : votes)
        vote = fraction[vote];
}

void fill_unlit(const ShadowCasters &casters, const LightPlace &light, int threads, std::span<std::uint8_t> fractions) {
    const FacingTest test(casters, light);
    const auto starts = casters.bricks(), bricks = starts.first(starts.size() - 1);
    if (bricks.empty())
        return;
    const std::size_t blocks = (bricks.size() + kBricksAtOnce - 1) / kBricksAtOnce;
    std::vector<LitSum> sums(bricks.size());
    parallel_for(blocks, threads, [&](std::size_t block) {
        for (std::size_t b = block * kBricksAtOnce; b < std::min(bricks.size(), (block + 1) * kBricksAtOnce); ++b)
            sums[b] = sum_brick(casters, test, b, fractions).all;
    });
    const std::vector<Given> given = given_to_bricks(bricks, std::move(sums));
    parallel_for(blocks, threads, [&](std::size_t block) {
        for (std::size_t b = block * kBricksAtOnce; b < std::min(bricks.size(), (block + 1) * kBricksAtOnce); ++b) {
            const BrickSums brick = sum_brick(casters, test, b, fractions);
            for (std::size_t i = bricks[b].first_point; i < starts[b + 1].first_point; ++i)
                if (!test.faces(bricks[b], i)) {
                    const std::size_t place = casters.places()[i];
                    fractions[i] = given[b].below(brick.fours[place >> 6U]).below(brick.pairs[place >> 3U]).value;
                }
        }
    });
}

} // namespace pbm
