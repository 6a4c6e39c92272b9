#include "pbm_build/voxels/voxelize.h"

#include "pbm_build/fields/field_votes.h"
#include "pbm_build/lattice/radix_sort.h"
#include "pbm_build/voxels/sample_cursor.h"
#include "pbm_format/model/normal.h"
#include "system/free_memory.h"
#include "system/threads/cancellation.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <iterator>
#include <memory>
#include <numeric>
#include <utility>

namespace pbm::build {
namespace {

// Hits are averaged in blocks of 32x32x32 voxels, whose table stays in the cache.
constexpr int kBlockBits = HitStore::kBlockBits;
constexpr std::uint32_t kBlockVoxels = 1U << kBlockBits;

std::uint32_t voxel_in_block(Hit hit) { return static_cast<std::uint32_t>(local_code_of(hit)) & (kBlockVoxels - 1); }

// Working memory of one thread for one bucket after the other. Averages the hits of a bucket block by block without
// sorting them: a bit per voxel marks the occupied ones, in Morton order.
class BucketVoxelizer {
  public:
    BucketVoxelizer(const SurfaceSampler &sampler, HitStore &store, const AttributeSet &set,
                    std::span<const Field> fields, bool with_offsets)
        : store_(store), cursor_(sampler), set_(set), fields_(fields), with_offsets_(with_offsets),
          point_in_block_(new std::uint16_t[kBlockVoxels]) {
        for (const Field &field : fields)
            field_votes_.emplace_back(field.average);
        rows_.fields.resize(fields.size());
        voxels_.fields.resize(fields.size());
    }

    // Null for an empty bucket.
    std::unique_ptr<Voxels> voxelize(std::size_t bucket) {
        hits_.clear();
        store_.take(bucket, hits_);
        if (hits_.empty())
            return nullptr;
        if (store_.local_bits() > kBlockBits)
            radix_sort(hits_, spare_, kSourceBits + kBlockBits, store_.local_bits() - kBlockBits);
        const MortonCode first_code = static_cast<MortonCode>(bucket) << store_.local_bits();
        for (auto begin = hits_.begin(); begin != hits_.end();) {
            const MortonCode block = local_code_of(*begin) >> kBlockBits;
            const auto end =
                std::find_if(begin, hits_.end(), [&](Hit hit) { return local_code_of(hit) >> kBlockBits != block; });
            add_block({begin, end}, first_code | block << kBlockBits);
            begin = end;
        }
        // Frees the spare capacity: the bucket stays in memory until all others are done.
        voxels_.codes.shrink_to_fit();
        voxels_.offsets.shrink_to_fit();
        for_columns(
            set_, [](const StreamInfo &, std::size_t, auto &column) { column.shrink_to_fit(); }, voxels_.points);
        auto voxels = std::make_unique<Voxels>(std::exchange(voxels_, {}));
        voxels_.fields.resize(fields_.size());
        return voxels;
    }

  private:
    // `hits`, not empty, all lie in the block whose first voxel is `first_code`.
    void add_block(std::span<const Hit> hits, MortonCode first_code) {
        const std::size_t first = voxels_.codes.size();
        number_voxels(hits, first_code);
        const std::size_t count = voxels_.codes.size() - first;
        sums_.assign(count, {});
        votes_.assign(set_.material ? count : 0, {});
        places_.assign(with_offsets_ ? count : 0, {});
        for (FieldVotes &votes : field_votes_)
            votes.begin(count);
        normals_.resize(hits.size());
        const auto corner = morton_decode(first_code);
        const glm::ivec3 block(corner[0], corner[1], corner[2]);
        for (std::size_t begin = 0; begin < hits.size(); begin += MixedRows::kRows)
            add_rows(hits.subspan(begin, std::min(hits.size() - begin, MixedRows::kRows)), block, &normals_[begin]);
        voxels_.points.resize(first + count, set_);
        bool may_be_walls = false;
        for (std::size_t i = 0; i < count; ++i) {
            if (is_hole(sums_[i]))
                continue;
            store(sums_[i], first + i);
            if (set_.material)
                voxels_.points.materials[first + i] = majority(votes_[i]);
            may_be_walls |= sums_[i].may_be_wall();
        }
        for (std::size_t f = 0; f < fields_.size(); ++f)
            field_votes_[f].append(fields_[f].bytes, voxels_.fields[f]);
        if (may_be_walls)
            average_walls(hits, block, first);
        if (with_offsets_)
            place_bent_voxels(hits, block);
        for (std::size_t i = 0; i < places_.size(); ++i)
            voxels_.offsets.push_back(offset_of(places_[i], voxels_.points.normals[first + i]));
        if (std::exchange(has_holes_, false))
            remove_holes(first);
    }

    // Whether images have cut all samples of a voxel away.
    bool is_hole(const VoxelSums &sums) const { return has_holes_ && sums.samples == 0; }

    // Removes those among the voxels from `first` on.
    void remove_holes(std::size_t first) {
        std::size_t kept = first;
        for (std::size_t i = 0; i < sums_.size(); ++i) {
            if (sums_[i].samples == 0)
                continue;
            voxels_.codes[kept] = voxels_.codes[first + i];
            for_columns(
                set_,
                [&](const StreamInfo &, std::size_t width, auto &column) {
                    for (std::size_t k = 0; k < width; ++k)
                        column[width * kept + k] = column[width * (first + i) + k];
                },
                voxels_.points);
            for (std::size_t f = 0; f < fields_.size(); ++f)
                set_stored_value(voxels_.fields[f], kept, fields_[f].bytes,
                                 stored_value(voxels_.fields[f], first + i, fields_[f].bytes));
            if (with_offsets_)
                voxels_.offsets[kept] = voxels_.offsets[first + i];
            ++kept;
        }
        if (with_offsets_)
            voxels_.offsets.resize(kept);
        for (std::size_t f = 0; f < fields_.size(); ++f)
            voxels_.fields[f].resize(kept * fields_[f].bytes);
        voxels_.codes.resize(kept);
        voxels_.points.resize(kept, set_);
    }

    // Numbers the occupied voxels in Morton order.
    void number_voxels(std::span<const Hit> hits, MortonCode first_code) {
        for (const Hit hit : hits)
            occupied_[voxel_in_block(hit) / 64] |= std::uint64_t{1} << voxel_in_block(hit) % 64;
        if (voxels_.codes.empty()) // most buckets are one block
            voxels_.codes.reserve(std::transform_reduce(
                occupied_.begin(), occupied_.end(), std::size_t{0}, std::plus<>(),
                [](std::uint64_t word) { return static_cast<std::size_t>(std::popcount(word)); }));
        std::uint16_t point = 0;
        for (std::size_t word = 0; word < occupied_.size(); ++word)
            for (std::uint64_t left = std::exchange(occupied_[word], 0); left != 0; left &= left - 1) {
                const std::size_t voxel = 64 * word + static_cast<std::size_t>(std::countr_zero(left));
                point_in_block_[voxel] = point++;
                voxels_.codes.push_back(first_code | voxel);
            }
    }

    static PlaceInBlock place_in_block(std::uint32_t voxel) {
        // Three bits per axis from nine.
        static constexpr std::array<PlaceInBlock, 512> kCellPositions = [] {
            std::array<PlaceInBlock, 512> places{};
            for (unsigned code = 0; code < places.size(); ++code)
                for (unsigned bit = 0; bit < 9; ++bit)
                    places[code] |= static_cast<PlaceInBlock>((code >> bit & 1) << (8 * (bit % 3) + bit / 3));
            return places;
        }();
        return kCellPositions[voxel % 512] + 8 * kCellPositions[voxel / 512];
    }

    // Computes the samples of at most MixedRows::kRows hits.
    void take_samples(std::span<const Hit> hits, const glm::ivec3 &block, Places places) {
        for (std::size_t row = 0; row < hits.size(); ++row)
            rows_.mixed.places[row] = place_in_block(voxel_in_block(hits[row]));
        cursor_.take(hits, block, rows_, places);
    }

    // At most MixedRows::kRows of them, whose normals are also written to `to`.
    void add_rows(std::span<const Hit> hits, const glm::ivec3 &block, ShortNormal *to) {
        take_samples(hits, block, with_offsets_ ? Places::nearest : Places::none);
        const auto &normals = rows_.mixed.normals.rounded;
        const auto &colours = rows_.mixed.colours;
        for (std::size_t row = 0; row < hits.size(); ++row) {
            const std::size_t point = point_in_block_[voxel_in_block(hits[row])];
            const Sample::Rest &rest = rows_.rest[row];
            if (rest.is_hole) {
                has_holes_ = true;
                to[row] = {};
                continue;
            }
            const std::array<std::int32_t, 3> normal{normals[0][row], normals[1][row], normals[2][row]};
            VoxelSums &sums = sums_[point];
            sums.add_normal(normal, rest.two_sided);
            sums.add_rest(rest);
            if (set_.colour != ColourFormat::none)
                sums.add_colour({colours[0][row], colours[1][row], colours[2][row]});
            if (set_.material)
                ++votes_[point][rest.material];
            if (with_offsets_)
                places_[point].add(rows_.places[row]);
            for (std::size_t f = 0; f < field_votes_.size(); ++f)
                field_votes_[f].add(point, rows_.fields[f][row]);
            to[row] = {static_cast<std::int16_t>(normal[0]), static_cast<std::int16_t>(normal[1]),
                       static_cast<std::int16_t>(normal[2])};
        }
    }

    void store(const VoxelSums &sums, std::size_t point) {
        voxels_.points.normals[point] = mean_normal(sums);
        sums.store_rest(voxels_.points, point);
        if (set_.colour != ColourFormat::none)
            set_point_colour(voxels_.points, point, set_.colour, sums.mean_colour());
    }

    // Places of a voxel's samples from its centre.
    struct PlaceSums {
        std::array<std::int64_t, 3> sum{};
        std::int64_t weight = 0;

        void add(const SamplePlace &place) {
            for (std::size_t axis = 0; axis < 3; ++axis)
                sum[axis] += std::int64_t{place.weight} * place.from_centre[axis];
            weight += place.weight;
        }
    };

    // Places the surface anew in voxels within which its normal changes: samples lie around the middle of an edge, and
    // the pieces of its faces below.
    void place_bent_voxels(std::span<const Hit> hits, const glm::ivec3 &block) {
        const auto is_bent = [&](Hit hit) { return sums_[point_in_block_[voxel_in_block(hit)]].is_bent(); };
        std::vector<Hit> bent;
        std::copy_if(hits.begin(), hits.end(), std::back_inserter(bent), is_bent);
        for (std::size_t i = 0; i < places_.size(); ++i)
            if (sums_[i].is_bent())
                places_[i] = {};
        for (std::size_t begin = 0; begin < bent.size(); begin += MixedRows::kRows) {
            const auto some = std::span(bent).subspan(begin, std::min(bent.size() - begin, MixedRows::kRows));
            take_samples(some, block, Places::pieces);
            for (std::size_t row = 0; row < some.size(); ++row)
                if (!rows_.rest[row].is_hole)
                    places_[point_in_block_[voxel_in_block(some[row])]].add(rows_.places[row]);
        }
    }

    // How far their mean lies along the normal.
    static std::int8_t offset_of(const PlaceSums &places, std::uint16_t normal) {
        if (normal > kNormalIndexMask || places.weight == 0) // a thin wall, or none
            return kNoOffset;
        const UnitVector &n = normal_table()[normal];
        double along = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            along += static_cast<double>(n[axis]) * static_cast<double>(places.sum[axis]);
        const long steps = std::lround(along * Offsets::kSteps / static_cast<double>(places.weight * kPlaceSteps));
        return std::abs(steps) > Offsets::kMost ? kNoOffset : static_cast<std::int8_t>(steps);
    }

    // Gives thin voxels the normal of their plane, and those with a wall both of its sides.
    void average_walls(std::span<const Hit> hits, const glm::ivec3 &block, std::size_t first) {
        wall_of_.assign(sums_.size(), 0);
        std::vector<PlaneSums> planes(1); // the first belongs to nothing
        for (std::size_t i = 0; i < sums_.size(); ++i)
            if (!is_hole(sums_[i]) && sums_[i].may_be_wall()) {
                wall_of_[i] = static_cast<std::uint32_t>(planes.size());
                planes.emplace_back();
            }
        std::vector<Hit> of_walls;
        for (std::size_t i = 0; i < hits.size(); ++i)
            if (const std::uint32_t wall = wall_of_[point_in_block_[voxel_in_block(hits[i])]]; wall != 0) {
                planes[wall].add({normals_[i][0], normals_[i][1], normals_[i][2]});
                of_walls.push_back(hits[i]);
            }
        for (std::size_t i = 0; i < sums_.size(); ++i)
            if (wall_of_[i] != 0 && sums_[i].is_thin())
                voxels_.points.normals[first + i] = plane_normal(planes[wall_of_[i]]);
        walls_.assign(planes.size(), {});
        for (std::size_t begin = 0; begin < of_walls.size(); begin += MixedRows::kRows)
            add_to_walls(std::span(of_walls).subspan(begin, std::min(of_walls.size() - begin, MixedRows::kRows)), block,
                         planes);
        for (std::size_t i = 0; i < sums_.size(); ++i)
            if (const WallSums &wall = walls_[wall_of_[i]]; wall_of_[i] != 0 && are_sides(wall.sides[0], wall.sides[1]))
                store_sides(wall, voxels_.codes[first + i]);
    }

    // Samples of both sides of a wall: those whose normals point along that of its plane, and the others.
    struct WallSums {
        std::array<VoxelSums, 2> sides;
        std::array<MaterialVotes, 2> votes{};
    };

    // At most MixedRows::kRows hits of voxels that may hold walls.
    void add_to_walls(std::span<const Hit> hits, const glm::ivec3 &block, std::span<const PlaneSums> planes) {
        take_samples(hits, block, Places::none);
        const auto &normals = rows_.mixed.normals.rounded;
        const auto &colours = rows_.mixed.colours;
        for (std::size_t row = 0; row < hits.size(); ++row) {
            const Sample::Rest &rest = rows_.rest[row];
            const std::uint32_t wall = wall_of_[point_in_block_[voxel_in_block(hits[row])]];
            const std::array<std::int32_t, 3> normal{normals[0][row], normals[1][row], normals[2][row]};
            double along = 0;
            for (std::size_t axis = 0; axis < 3; ++axis)
                along += static_cast<double>(planes[wall].normal()[axis]) * normal[axis];
            if (rest.is_hole || along == 0)
                continue;
            const std::size_t side = along > 0 ? 0 : 1;
            walls_[wall].sides[side].add_normal(normal, rest.two_sided);
            if (set_.colour != ColourFormat::none)
                walls_[wall].sides[side].add_colour({colours[0][row], colours[1][row], colours[2][row]});
            if (set_.material)
                ++walls_[wall].votes[side][rest.material];
        }
    }

    void store_sides(const WallSums &wall, MortonCode code) {
        VoxelSides &to = voxels_.sides;
        to.codes.push_back(code);
        to.values.resize(2 * to.codes.size(), set_);
        to.values.radii.clear();
        for (std::size_t side = 0; side < 2; ++side) {
            const std::size_t at = 2 * (to.codes.size() - 1) + side;
            to.values.normals[at] = quantise_normal(wall.sides[side].normal);
            if (set_.colour != ColourFormat::none)
                set_point_colour(to.values, at, set_.colour, wall.sides[side].mean_colour());
            if (set_.material)
                to.values.materials[at] = majority(wall.votes[side]);
        }
    }

    HitStore &store_;
    std::vector<Hit> hits_, spare_;
    SampleCursor cursor_;
    const AttributeSet &set_;
    std::span<const Field> fields_;
    const bool with_offsets_;
    std::vector<FieldVotes> field_votes_;             // [fields]
    std::unique_ptr<std::uint16_t[]> point_in_block_; // of occupied voxels; the rest is not set
    std::array<std::uint64_t, kBlockVoxels / 64> occupied_{};
    std::vector<VoxelSums> sums_;
    std::vector<MaterialVotes> votes_;
    std::vector<PlaceSums> places_; // of each voxel of the block, if offsets are asked for
    SampleRows rows_;
    bool has_holes_ = false;             // an image cuts a sample of the block away
    std::vector<ShortNormal> normals_;   // of the block's hits
    std::vector<std::uint32_t> wall_of_; // of each voxel of the block, in walls_; 0: none
    std::vector<WallSums> walls_;
    Voxels voxels_;
};

} // namespace

void append_sides(const VoxelSides &from, const AttributeSet &set, VoxelSides &to) {
    to.codes.insert(to.codes.end(), from.codes.begin(), from.codes.end());
    to.values.append(from.values, set);
}

Voxels voxelize(const SurfaceSampler &sampler, HitStore &store, const BucketRange &range, const AttributeSet &set,
                std::span<const Field> fields, bool with_offsets, int threads) {
    std::vector<std::unique_ptr<Voxels>> buckets(range.last - range.first); // null: empty
    std::atomic<std::size_t> next{0};
    const int workers = resolve_threads(threads);
    parallel_for(static_cast<std::size_t>(workers), workers, [&](std::size_t) {
        BucketVoxelizer voxelizer(sampler, store, set, fields, with_offsets);
        for (std::size_t bucket = next++; bucket < buckets.size(); bucket = next++) {
            check_cancelled();
            buckets[bucket] = voxelizer.voxelize(range.first + bucket);
        }
    });

    std::vector<std::size_t> starts(buckets.size() + 1, 0);
    for (std::size_t b = 0; b < buckets.size(); ++b)
        starts[b + 1] = starts[b] + (buckets[b] ? buckets[b]->codes.size() : 0);
    // Column by column, so that at most one of them is there twice.
    Voxels all;
    const auto gather = [&](std::size_t width, auto &to, const auto &column_of) {
        to.resize(width * starts.back());
        parallel_for(buckets.size(), threads, [&](std::size_t b) {
            if (!buckets[b])
                return;
            auto &from = column_of(*buckets[b]);
            std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(width * starts[b]));
            free_memory(from);
        });
    };
    gather(
        1, all.codes, [](Voxels & of) -> auto & { return of.codes; });
    if (with_offsets)
        gather(
            1, all.offsets, [](Voxels & of) -> auto & { return of.offsets; });
    for (const StreamInfo &stream : point_streams())
        if (stream.kind == StreamKind::normal)
            gather(
                1, all.points.normals, [](Voxels & of) -> auto & { return of.points.normals; });
        else
            gather(
                bytes_per_point(stream, set),
                all.points.values(stream), [&](Voxels & of) -> auto & { return of.points.values(stream); });
    for (std::size_t f = 0; f < fields.size(); ++f)
        gather(
            fields[f].bytes, all.fields.emplace_back(), [&](Voxels & of) -> auto & { return of.fields[f]; });
    for (const std::unique_ptr<Voxels> &bucket : buckets)
        if (bucket)
            append_sides(bucket->sides, set, all.sides);
    return all;
}

} // namespace pbm::build
