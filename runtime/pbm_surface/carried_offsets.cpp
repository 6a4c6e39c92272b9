#include "pbm_surface/carried_offsets.h"

#include "pbm_format/model/normal.h"
#include "pbm_format/model/point_values.h"
#include "pbm_surface/brick_neighbours.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

namespace pbm {
namespace {

// Neighbours whose normals differ by more than this cosine lie across an edge or on the other side of a thin wall.
constexpr float kSameSide = 0.5F;
constexpr std::size_t kBricksAtOnce = 64;

constexpr std::size_t kOctants = 8;       // of a brick: 4x4x4 voxels each
constexpr std::size_t kOctantPlaces = 64; // their places are consecutive

// A brick and two layers of voxels around it.
constexpr std::uint32_t kMaxPadding = 2;
constexpr PaddedLayout kLayout{.row = 12, .slice = 144, .first = 2 + 2 * 12 + 2 * 144};
constexpr std::size_t kPaddedVoxels = 12 * 144;

// [direction][512]: index in a padded brick of each position (Morton code) in the neighbour; -1: farther from the brick
// than `padding` voxels.
using PaddedPlaces = std::vector<std::array<std::int16_t, 512>>;
const PaddedPlaces &padded_places(std::uint32_t padding) {
    static const auto tables = [] {
        std::array<PaddedPlaces, kMaxPadding> all;
        for (std::uint32_t layers = 1; layers <= kMaxPadding; ++layers) {
            PaddedPlaces &table = all[layers - 1];
            table.resize(kDirectionCount);
            for (std::size_t direction = 0; direction < kDirectionCount; ++direction)
                for (std::size_t place = 0; place < 512; ++place) {
                    const auto voxel = morton_decode(place);
                    bool near = true;
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        const int step = steps_of(direction)[axis];
                        near &= step == 0 || (step > 0 ? voxel[axis] < layers : voxel[axis] + layers >= kBrickEdge);
                    }
                    table[direction][place] =
                        static_cast<std::int16_t>(near ? kLayout.index(voxel) + kLayout.step(direction) : -1);
                }
        }
        return all;
    }();
    return tables[padding - 1];
}

// [direction]: the octants of a neighbour that lie next to the brick, as bits.
constexpr std::array<std::uint8_t, kDirectionCount> kOctantsBeside = [] {
    std::array<std::uint8_t, kDirectionCount> beside{};
    for (std::size_t direction = 0; direction < kDirectionCount; ++direction)
        for (std::uint32_t octant = 0; octant < kOctants; ++octant)
            beside[direction] |= static_cast<std::uint8_t>(
                touches({octant & 1, octant >> 1 & 1, octant >> 2}, 1, opposite(direction)) << octant);
    return beside;
}();

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

// A voxel near a point.
struct VoxelStep {
    float x, y, z;
    int places; // from the point's place in a padded brick
};

constexpr VoxelStep step_by(int x, int y, int z) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z),
            x + y * kLayout.row + z * kLayout.slice};
}

// The 27 voxels around a point, x fastest; those to its left and to its right, as bits.
constexpr std::array<VoxelStep, 27> kAround = [] {
    std::array<VoxelStep, 27> around{};
    for (int i = 0; i < 27; ++i)
        around[static_cast<std::size_t>(i)] = step_by(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    return around;
}();
constexpr std::uint32_t kRowBits = 7, kSliceBits = 0777, kLeft = 0111111111, kRight = 0444444444, kLow = 07007007,
                        kHigh = 0700700700;

// The voxels above a point that may hold a layer: their centres lie within `aside` of the line along its normal.
using Column = std::vector<VoxelStep>;
constexpr double kLowest = 0.3; // least height of such a centre

// Normals with the same first digits share a column, computed for their middle one.
constexpr int kColumnShift = 4;

std::vector<Column> columns_within(double aside) {
    std::vector<Column> columns(kNormalCount >> kColumnShift);
    constexpr int kReach = kMaxPadding;
    for (std::size_t i = 0; i < columns.size(); ++i) {
        const UnitVector &n = normal_table()[i << kColumnShift];
        for (int z = -kReach; z <= kReach; ++z)
            for (int y = -kReach; y <= kReach; ++y)
                for (int x = -kReach; x <= kReach; ++x) {
                    const double along = n[0] * x + n[1] * y + n[2] * z;
                    if (along >= kLowest && x * x + y * y + z * z - along * along <= aside * aside)
                        columns[i].push_back(step_by(x, y, z));
                }
    }
    return columns;
}

// Splats larger than a voxel cover the line from farther away.
constexpr double kDenseAside = 1, kSparseAside = 2;
const Column &column_of(std::uint16_t normal, bool sparse) {
    static const std::array<std::vector<Column>, 2> columns{columns_within(kDenseAside), columns_within(kSparseAside)};
    return columns[sparse ? 1 : 0][(normal & kNormalIndexMask) >> kColumnShift];
}

std::int8_t quantise(float offset) {
    const float steps = offset * kCarriedSteps;
    return static_cast<std::int8_t>(std::clamp(std::floor(steps + 0.5F), -127.0F, 127.0F));
}

// The tangent planes of the points of a brick and of the voxels around it.
class PaddedBrick {
  public:
    PaddedBrick() { planes_.fill({0, 0, 0, 0, 0}); }

    void clear() {
        for (const std::int16_t index : filled_)
            planes_[static_cast<std::size_t>(index)] = {0, 0, 0, 0, 0};
        filled_.clear();
        rows_.fill(0);
    }
    void add(std::int16_t index) {
        rows_[static_cast<std::size_t>(index / kLayout.row)] |= static_cast<std::uint16_t>(1 << index % kLayout.row);
    }
    void add(std::int16_t index, const Plane &plane) {
        add(index);
        planes_[static_cast<std::size_t>(index)] = plane;
        filled_.push_back(index);
    }

    // Distance along the normal from the point's voxel centre to the mean of the occupied voxels around it.
    float mean_distance(std::size_t at, const Normal &normal) const {
        const std::uint32_t around = occupied_around(at);
        const auto number = [](std::uint32_t voxels) { return std::popcount(voxels); };
        const int count = number(around), sum_x = number(around & kRight) - number(around & kLeft),
                  sum_y = number(around & kHigh) - number(around & kLow),
                  sum_z = number(around >> 18) - number(around & kSliceBits);
        const float mean = (normal.x * static_cast<float>(sum_x) + normal.y * static_cast<float>(sum_y) +
                            normal.z * static_cast<float>(sum_z)) /
                           static_cast<float>(count);
        return std::clamp(mean, -normal.limit, normal.limit);
    }

    // Mean of the estimates that neighbours of the same side carry to a point along the mean of the two normals: two
    // points of a smooth surface lie across that mean.
    float carried_distance(std::size_t at) const {
        const Plane &own = planes_[at];
        float sum = 0, count = 0;
        for (std::uint32_t around = occupied_around(at); around != 0; around &= around - 1) {
            const float carried = carried_from(at, kAround[static_cast<std::size_t>(std::countr_zero(around))]);
            if (std::abs(carried) <= 2 * own.limit) {
                sum += carried;
                count += 1;
            }
        }
        return count > 0 ? std::clamp(sum / count, -own.limit, own.limit) : own.distance;
    }

    // Distance from the surface of a point to the outermost layer: the highest estimate in its column.
    float layers_above(std::size_t at, const Column &column) const {
        const Plane &own = planes_[at];
        float highest = own.distance;
        for (const VoxelStep &step : column)
            if (const float carried = carried_from(at, step); carried <= own.distance + kMaxLayer)
                highest = std::max(highest, carried);
        return highest - own.distance;
    }

  private:
    // Bit i: voxel i of kAround is occupied.
    std::uint32_t occupied_around(std::size_t at) const {
        constexpr std::size_t kSliceRows = kLayout.slice / kLayout.row;
        const std::size_t row = at / kLayout.row, left = at % kLayout.row - 1;
        std::uint32_t around = 0;
        for (std::size_t i = 0; i < 9; ++i)
            around |= (static_cast<std::uint32_t>(rows_[row - kSliceRows - 1 + i / 3 * kSliceRows + i % 3]) >> left &
                       kRowBits)
                      << 3 * i;
        return around;
    }

    // The estimate of a voxel, extended to the normal of the point at `at`. NaN if the voxel is empty or not of the
    // same side.
    float carried_from(std::size_t at, const VoxelStep &step) const {
        const Plane &own = planes_[at], &other = *(&own + step.places);
        const float cosine = own.x * other.x + own.y * other.y + own.z * other.z;
        if (cosine < kSameSide)
            return std::numeric_limits<float>::quiet_NaN();
        const float across = (own.x + other.x) * step.x + (own.y + other.y) * step.y + (own.z + other.z) * step.z;
        // n_j . (n_i + n_j) = n_i . (n_i + n_j) = 1 + cosine.
        return other.distance + across / (1 + cosine);
    }

    std::array<Plane, kPaddedVoxels> planes_;                       // zero: empty voxel
    std::array<std::uint16_t, kPaddedVoxels / kLayout.row> rows_{}; // [z][y] bit x: occupied
    std::vector<std::int16_t> filled_;
};

// The bricks of a level and how they lie beside each other.
class BrickGrid {
  public:
    BrickGrid(const LevelPoints &points, int threads)
        : points_(points), count_(points.bricks.size() - 1), around_(count_), octants_(count_) {
        std::vector<MortonCode> codes(count_);
        for (std::size_t b = 0; b < count_; ++b)
            codes[b] =
                morton_encode(points.bricks[b].corner[0], points.bricks[b].corner[1], points.bricks[b].corner[2]);
        parallel_for(count_, kBricksAtOnce, threads, [&](std::size_t b) {
            for (std::size_t direction = 0; direction < kDirectionCount; ++direction)
                around_[b][direction] = static_cast<std::uint32_t>(find(codes, b, direction));
            find_octants(b);
        });
    }

    // Fills `padded` brick by brick, calling add(padded, place, point) for each point of a brick and of the voxels
    // within `padding` around it; then calls estimate(padded, place, point) for each point of the brick.
    template <class Add, class Estimate>
    void for_points(std::uint32_t padding, int threads, const Add &add, const Estimate &estimate) const {
        const PaddedPlaces &table = padded_places(padding);
        parallel_blocks(count_, kBricksAtOnce, threads, [&](std::size_t begin, std::size_t end) {
            PaddedBrick padded;
            for (std::size_t b = begin; b < end; ++b) {
                padded.clear();
                for (std::size_t direction = 0; direction < kDirectionCount; ++direction)
                    if (const std::size_t other = around_[b][direction]; other != count_)
                        for_points_beside(other, direction, [&](std::size_t i) {
                            if (const std::int16_t at = table[direction][points_.places[i]]; at >= 0)
                                add(padded, at, i);
                        });
                for (std::size_t i = first_point(b); i < first_point(b + 1); ++i)
                    estimate(padded, static_cast<std::size_t>(table[kNoDirection][points_.places[i]]), i);
            }
        });
    }

  private:
    std::size_t first_point(std::size_t brick) const {
        return static_cast<std::size_t>(points_.bricks[brick].first_point);
    }

    // Calls work(point) for the points of a neighbour in the octants next to the brick.
    template <class Work> void for_points_beside(std::size_t neighbour, std::size_t direction, const Work &work) const {
        const std::size_t first = first_point(neighbour);
        const auto &starts = octants_[neighbour];
        for (unsigned octants = kOctantsBeside[direction]; octants != 0; octants &= octants - 1) {
            const auto octant = static_cast<std::size_t>(std::countr_zero(octants));
            for (std::size_t i = first + starts[octant]; i < first + starts[octant + 1]; ++i)
                work(i);
        }
    }

    // The neighbour of brick `b` in direction `direction`, or count_ if there is none.
    std::size_t find(const std::vector<MortonCode> &codes, std::size_t b, std::size_t direction) const {
        const auto edge = static_cast<std::int64_t>(std::max(1, 1 << points_.level >> 3));
        const auto steps = steps_of(direction);
        const auto &corner = points_.bricks[b].corner;
        const std::int64_t x = corner[0] + steps[0], y = corner[1] + steps[1], z = corner[2] + steps[2];
        if (std::min({x, y, z}) < 0 || std::max({x, y, z}) >= edge)
            return count_;
        const MortonCode code =
            morton_encode(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z));
        const auto found = std::lower_bound(codes.begin(), codes.end(), code);
        return found == codes.end() || *found != code ? count_ : static_cast<std::size_t>(found - codes.begin());
    }

    void find_octants(std::size_t b) {
        const std::size_t first = first_point(b), end = first_point(b + 1);
        std::size_t i = first;
        for (std::size_t octant = 0; octant <= kOctants; ++octant) {
            while (i < end && points_.places[i] < octant * kOctantPlaces)
                ++i;
            octants_[b][octant] = static_cast<std::uint16_t>(i - first);
        }
    }

    const LevelPoints &points_;
    std::size_t count_;
    std::vector<std::array<std::uint32_t, kDirectionCount>> around_; // [bricks][directions], count_: none
    std::vector<std::array<std::uint16_t, kOctants + 1>> octants_;   // [bricks]: the first of their points, and the end
};

} // namespace

CarriedOffsets carried_offsets(const LevelPoints &points, int threads) {
    const BrickGrid grid(points, threads);
    const std::size_t count = points.places.size();
    std::vector<std::int8_t> means(count), carried(count);
    std::vector<std::uint8_t> layers(count);
    const auto &normals = float_normals();
    const auto normal_of = [&](std::size_t i) -> const Normal & {
        return normals[points.normals[i] & kNormalIndexMask];
    };
    grid.for_points(
        1, threads, [](PaddedBrick &padded, std::int16_t at, std::size_t) { padded.add(at); },
        [&](const PaddedBrick &padded, std::size_t at, std::size_t i) {
            means[i] = quantise(padded.mean_distance(at, normal_of(i)));
        });
    const auto add_planes = [&](const std::vector<std::int8_t> &distances) {
        return [&](PaddedBrick &padded, std::int16_t at, std::size_t i) {
            const Normal &n = normal_of(i);
            padded.add(at, {n.x, n.y, n.z, static_cast<float>(distances[i]) * (1.0F / kCarriedSteps), n.limit});
        };
    };
    grid.for_points(1, threads, add_planes(means), [&](const PaddedBrick &padded, std::size_t at, std::size_t i) {
        carried[i] = quantise(padded.carried_distance(at));
    });
    const std::uint8_t one_voxel = radius_index(1.0 / static_cast<double>(std::uint64_t{1} << points.level));
    grid.for_points(kMaxPadding, threads, add_planes(carried),
                    [&](const PaddedBrick &padded, std::size_t at, std::size_t i) {
                        if ((points.normals[i] & kTwoSidedBit) != 0)
                            return;
                        const Column &column = column_of(points.normals[i], points.radii[i] > one_voxel);
                        layers[i] = static_cast<std::uint8_t>(padded.layers_above(at, column) * kCarriedSteps + 0.5F);
                    });
    return {std::move(carried), std::move(layers)};
}

} // namespace pbm
