#include "pbm_bake/shadow_casters.h"

#include "pbm_bake/padded_brick.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>

namespace pbm {
namespace {

constexpr unsigned kPlaceBits = 9;
constexpr MortonCode kPlaceMask = (1U << kPlaceBits) - 1;
// Neighbours whose normals are further apart than this cosine lie on other sides of edges and thin walls.
constexpr float kSameSide = 0.5F;
constexpr std::size_t kBricksAtOnce = 64;

std::vector<MortonCode> finest_codes(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = expand_level(codes, model.levels[level].masks, model.levels[level].points.size()).value();
    return codes;
}

MortonCode brick_code(const CasterBrick &brick) {
    return morton_encode(brick.corner[0], brick.corner[1], brick.corner[2]);
}

struct Plane {
    float x, y, z;  // normal
    float distance; // of the surface from the voxel's centre along it
    float limit;    // half of the voxel's extent along it
};

struct Normal {
    float x, y, z, limit;
};

const std::vector<Normal> &float_normals() {
    static const std::vector<Normal> normals = [] {
        std::vector<Normal> all;
        all.reserve(kNormalCount);
        for (const UnitVector &n : normal_table())
            all.push_back({static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2]),
                           static_cast<float>((std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2])) / 2)});
        return all;
    }();
    return normals;
}

std::int8_t quantise(float offset) {
    const float steps = offset * ShadowCasters::kOffsetSteps;
    return static_cast<std::int8_t>(std::clamp(std::floor(steps + 0.5F), -127.0F, 127.0F));
}

// The points of a brick and of one voxel around it.
class PaddedBrick {
  public:
    PaddedBrick() { planes_.fill({0, 0, 0, 0, 0}); }

    void clear() {
        for (const std::int16_t index : filled_)
            planes_[static_cast<std::size_t>(index)] = {0, 0, 0, 0, 0};
        filled_.clear();
    }
    void add(std::int16_t index, const Plane &plane) {
        planes_[static_cast<std::size_t>(index)] = plane;
        filled_.push_back(index);
    }

    // Mean distance of the occupied voxels around a point from its centre, along its normal.
    float mean_distance(std::size_t at) const {
        const Plane &own = planes_[at];
        int count = 0, sum_x = 0, sum_y = 0, sum_z = 0;
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y) {
                const Plane *const row = &planes_[at] + z * kPaddedSlice + y * kPaddedEdge;
                const int left = row[-1].limit > 0, middle = row[0].limit > 0, right = row[1].limit > 0;
                const int all = left + middle + right;
                count += all;
                sum_x += right - left;
                sum_y += y * all;
                sum_z += z * all;
            }
        const float mean = (own.x * static_cast<float>(sum_x) + own.y * static_cast<float>(sum_y) +
                            own.z * static_cast<float>(sum_z)) /
                           static_cast<float>(count);
        return std::clamp(mean, -own.limit, own.limit);
    }

    // Mean over the neighbours on the same side of what they say about a point: between two points of a smooth surface
    // the way is across the mean of their normals.
    float carried_distance(std::size_t at) const {
        const Plane &own = planes_[at];
        float sum = 0, count = 0;
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y)
                for (int x = -1; x <= 1; ++x) {
                    const Plane &other = *(&planes_[at] + z * kPaddedSlice + y * kPaddedEdge + x);
                    const float cosine = own.x * other.x + own.y * other.y + own.z * other.z;
                    if (cosine < kSameSide)
                        continue;
                    const float across = (own.x + other.x) * static_cast<float>(x) +
                                         (own.y + other.y) * static_cast<float>(y) +
                                         (own.z + other.z) * static_cast<float>(z);
                    // n_j . (n_i + n_j) = n_i . (n_i + n_j) = 1 + cosine.
                    const float carried = other.distance + across / (1 + cosine);
                    if (std::abs(carried) > 2 * own.limit)
                        continue;
                    sum += carried;
                    count += 1;
                }
        return count > 0 ? std::clamp(sum / count, -own.limit, own.limit) : own.distance;
    }

  private:
    std::array<Plane, kPaddedVoxels> planes_; // limit 0: empty voxel
    std::vector<std::int16_t> filled_;
};

} // namespace

ShadowCasters::ShadowCasters(const Model &model, int threads)
    : ShadowCasters(model.parameters.grid,
                    {model.parameters.grid.depth, finest_codes(model), model.levels.back().points.normals,
                     model.levels.back().points.radii},
                    threads) {}

ShadowCasters::ShadowCasters(const Grid &grid, const PointsOfLevel &points, int threads)
    : level_(points.level), voxel_size_(grid.voxel_size_at(points.level)), up_(grid.up), normals_(points.normals),
      radii_(points.radii) {
    assert(points.codes.size() == normals_.size() && normals_.size() == radii_.size());
    find_bricks(points.codes);
    find_surface(threads);
}

void ShadowCasters::find_bricks(std::span<const MortonCode> codes) {
    places_.resize(codes.size());
    MortonCode last = ~MortonCode{0};
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const MortonCode brick = codes[i] >> kPlaceBits;
        if (brick != last) {
            const auto corner = morton_decode(brick);
            bricks_.push_back({{static_cast<std::uint16_t>(corner[0]), static_cast<std::uint16_t>(corner[1]),
                                static_cast<std::uint16_t>(corner[2])},
                               i});
            last = brick;
        }
        places_[i] = static_cast<std::uint16_t>(codes[i] & kPlaceMask);
    }
    bricks_.push_back({{}, codes.size()});
}

void ShadowCasters::find_surface(int threads) {
    const std::size_t brick_count = bricks_.size() - 1;
    std::vector<MortonCode> codes(brick_count);
    for (std::size_t b = 0; b < brick_count; ++b)
        codes[b] = brick_code(bricks_[b]);
    const auto edge = static_cast<std::int64_t>(std::max(1, 1 << level_ >> 3));
    offsets_.assign(places_.size(), 0);
    std::vector<std::int8_t> carried(places_.size());

    // Both passes look at a brick and one voxel around it; `from` is what is known of distances so far.
    const auto pass = [&](const std::vector<std::int8_t> *from, std::vector<std::int8_t> &to) {
        parallel_for((brick_count + kBricksAtOnce - 1) / kBricksAtOnce, threads, [&](std::size_t block) {
            const auto &table = padded_places();
            const auto &normals = float_normals();
            PaddedBrick padded;
            const std::size_t end = std::min(brick_count, (block + 1) * kBricksAtOnce);
            for (std::size_t b = block * kBricksAtOnce; b < end; ++b) {
                padded.clear();
                for (int shift = 0; shift < 27; ++shift) {
                    const std::int64_t x = bricks_[b].corner[0] + shift % 3 - 1,
                                       y = bricks_[b].corner[1] + shift / 3 % 3 - 1,
                                       z = bricks_[b].corner[2] + shift / 9 - 1;
                    if (std::min({x, y, z}) < 0 || std::max({x, y, z}) >= edge)
                        continue;
                    std::size_t other = b;
                    if (shift != kMiddleBrick) {
                        const MortonCode code =
                            morton_encode(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                          static_cast<std::uint32_t>(z));
                        const auto found = std::lower_bound(codes.begin(), codes.end(), code);
                        if (found == codes.end() || *found != code)
                            continue;
                        other = static_cast<std::size_t>(found - codes.begin());
                    }
                    for (std::uint64_t i = bricks_[other].first_point; i < bricks_[other + 1].first_point; ++i)
                        if (const std::int16_t at = table[static_cast<std::size_t>(shift)][places_[i]]; at >= 0) {
                            const Normal &n = normals[normals_[i] & kNormalIndexMask];
                            const float distance =
                                from == nullptr ? 0.0F : static_cast<float>((*from)[i]) * (1.0F / kOffsetSteps);
                            padded.add(at, {n.x, n.y, n.z, distance, n.limit});
                        }
                }
                for (std::uint64_t i = bricks_[b].first_point; i < bricks_[b + 1].first_point; ++i) {
                    const auto at = static_cast<std::size_t>(table[kMiddleBrick][places_[i]]);
                    to[i] = quantise(from == nullptr ? padded.mean_distance(at) : padded.carried_distance(at));
                }
            }
        });
    };
    pass(nullptr, carried);
    pass(&carried, offsets_);
}

} // namespace pbm
