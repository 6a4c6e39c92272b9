#include "pbm_surface/carried_offsets.h"

#include "pbm_format/model/normal.h"
#include "pbm_surface/brick_neighbours.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace pbm {
namespace {

// Neighbours whose normals differ by more than this cosine lie across an edge or on the other side of a thin wall.
constexpr float kSameSide = 0.5F;
constexpr std::size_t kBricksAtOnce = 64;

// A brick and the layer of voxels around it.
constexpr PaddedLayout kLayout{.row = 10, .slice = 100, .first = 111};
constexpr std::size_t kPaddedVoxels = 1000;

// [direction][512]: index in a padded brick of each position (Morton code) in the neighbour; -1: outside of the
// padding.
const std::vector<std::array<std::int16_t, 512>> &padded_places() {
    static const auto table = [] {
        std::vector<std::array<std::int16_t, 512>> all(kDirectionCount);
        for (std::size_t direction = 0; direction < kDirectionCount; ++direction)
            for (std::size_t place = 0; place < 512; ++place) {
                const auto voxel = morton_decode(place);
                all[direction][place] = static_cast<std::int16_t>(touches(voxel, kBrickEdge - 1, opposite(direction))
                                                                      ? kLayout.index(voxel) + kLayout.step(direction)
                                                                      : -1);
            }
        return all;
    }();
    return table;
}

struct Plane {
    float x, y, z;  // normal
    float distance; // from the voxel's centre to the surface along the normal
    float limit;    // half of the voxel's extent along the normal
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
    const float steps = offset * kCarriedSteps;
    return static_cast<std::int8_t>(std::clamp(std::floor(steps + 0.5F), -127.0F, 127.0F));
}

// The tangent planes of the points of a brick and of the layer of voxels around it.
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

    // Distance along the normal from the point's voxel centre to the mean of the occupied voxels around it.
    float mean_distance(std::size_t at) const {
        const Plane &own = planes_[at];
        int count = 0, sum_x = 0, sum_y = 0, sum_z = 0;
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y) {
                const Plane *const row = &planes_[at] + z * kLayout.slice + y * kLayout.row;
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

    // Mean of the estimates that neighbours of the same side carry to a point along the mean of the two normals: two
    // points of a smooth surface lie across that mean.
    float carried_distance(std::size_t at) const {
        const Plane &own = planes_[at];
        float sum = 0, count = 0;
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y)
                for (int x = -1; x <= 1; ++x) {
                    const Plane &other = *(&planes_[at] + z * kLayout.slice + y * kLayout.row + x);
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

std::vector<std::int8_t> carried_offsets(const LevelPoints &points, int threads) {
    const std::span<const LevelBrick> bricks = points.bricks;
    const std::size_t brick_count = bricks.size() - 1;
    std::vector<MortonCode> codes(brick_count);
    for (std::size_t b = 0; b < brick_count; ++b)
        codes[b] = morton_encode(bricks[b].corner[0], bricks[b].corner[1], bricks[b].corner[2]);
    const auto edge = static_cast<std::int64_t>(std::max(1, 1 << points.level >> 3));
    // The neighbour of brick `b` in direction `direction`, or brick_count if there is none.
    const auto find = [&](std::size_t b, std::size_t direction) {
        const auto steps = steps_of(direction);
        const std::int64_t x = bricks[b].corner[0] + steps[0], y = bricks[b].corner[1] + steps[1],
                           z = bricks[b].corner[2] + steps[2];
        if (std::min({x, y, z}) < 0 || std::max({x, y, z}) >= edge)
            return brick_count;
        const MortonCode code =
            morton_encode(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z));
        const auto found = std::lower_bound(codes.begin(), codes.end(), code);
        return found == codes.end() || *found != code ? brick_count : static_cast<std::size_t>(found - codes.begin());
    };
    // `from` holds the estimates of the previous pass; empty for the first pass.
    const auto pass = [&](std::span<const std::int8_t> from) {
        std::vector<std::int8_t> to(points.places.size());
        parallel_for((brick_count + kBricksAtOnce - 1) / kBricksAtOnce, threads, [&](std::size_t block) {
            const auto &table = padded_places();
            const auto &normals = float_normals();
            PaddedBrick padded;
            const std::size_t end = std::min(brick_count, (block + 1) * kBricksAtOnce);
            for (std::size_t b = block * kBricksAtOnce; b < end; ++b) {
                padded.clear();
                for (std::size_t direction = 0; direction < kDirectionCount; ++direction) {
                    const std::size_t other = direction == kNoDirection ? b : find(b, direction);
                    if (other == brick_count)
                        continue;
                    for (auto i = static_cast<std::size_t>(bricks[other].first_point);
                         i < bricks[other + 1].first_point; ++i)
                        if (const std::int16_t at = table[direction][points.places[i]]; at >= 0) {
                            const Normal &n = normals[points.normals[i] & kNormalIndexMask];
                            const float distance =
                                from.empty() ? 0.0F : static_cast<float>(from[i]) * (1.0F / kCarriedSteps);
                            padded.add(at, {n.x, n.y, n.z, distance, n.limit});
                        }
                }
                for (auto i = static_cast<std::size_t>(bricks[b].first_point); i < bricks[b + 1].first_point; ++i) {
                    const auto at = static_cast<std::size_t>(table[kNoDirection][points.places[i]]);
                    to[i] = quantise(from.empty() ? padded.mean_distance(at) : padded.carried_distance(at));
                }
            }
        });
        return to;
    };
    return pass(pass({}));
}

} // namespace pbm
