// Computes the averages of the coarser levels. BVG.md 7
#include "pbm_format/levels/averages.h"
#include "pbm_format/levels/subtree_merge.h"
#include "system/free_memory.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <compare>
#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <type_traits>

namespace pbm {

namespace {

// Factor that scales values of 1, 2, 4 or 8 bits to 0..255: 2^bits - 1 divides 255.
std::uint32_t scale_to_byte(unsigned bits) { return 255U / ((1U << bits) - 1U); }

// Mean, rounded half up.
std::uint64_t mean(std::uint64_t sum, std::uint64_t votes) { return (2 * sum + votes) / (2 * votes); }

// A number of more than 64 bits as two digits to the base 2^48: 32-bit machines have no wider integers.
struct Wide {
    std::uint64_t high = 0, low = 0;
    auto operator<=>(const Wide &) const = default;
};

// The sum of the squares of up to three numbers below 2^48.
Wide sum_squares(std::initializer_list<std::uint64_t> numbers) {
    Wide sum;
    for (const std::uint64_t number : numbers) {
        const std::uint64_t high = number >> 24, low = number & 0xFFFFFF, mixed = 2 * high * low;
        sum.high += high * high + (mixed >> 24);
        sum.low += ((mixed & 0xFFFFFF) << 24) + low * low;
    }
    return {sum.high + (sum.low >> 48), sum.low & 0xFFFFFFFFFFFF};
}

// Whether |normal sum| is at least half of its maximum: 4 |normal|^2 >= (32767 votes)^2.
bool is_half_as_long(const CommonSums &sums) {
    const auto twice = [&](std::size_t c) { return 2 * static_cast<std::uint64_t>(std::abs(sums.normal[c])); };
    const std::uint64_t x = twice(0), y = twice(1), z = twice(2), full = 32767 * sums.votes;
    if (sums.votes < 32768) // all numbers are at most 2^31: both sides fit into 64 bits
        return x * x + y * y + z * z >= full * full;
    return sum_squares({x, y, z}) >= sum_squares({full}); // all numbers are below 2^48
}

// BVG.md 7.3: points of thin walls, whose normals cancel, become two-sided with the normal of the wall's plane.
std::uint16_t average_normal(const CommonSums &sums) {
    if (!sums.two_sided && is_half_as_long(sums))
        return quantise_normal(sums.normal);
    std::array<std::int64_t, 3> normal = plane_normal(sums);
    // Of the plane's two normals, take the one on the side of the sum: an only child's normal then stays the same.
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c)
        along += static_cast<double>(normal[c]) * static_cast<double>(sums.normal[c]);
    if (along < 0)
        for (std::int64_t &component : normal)
            component = -component;
    return quantise_normal(normal) | kTwoSidedBit;
}

// Averages nodes depth first, with one cursor per level.
template <class Sums> class Averager {
    static constexpr bool kEverything = std::is_same_v<Sums, PointSums>;

  public:
    Averager(const Subtree &subtree, const AttributeSet &set, const std::array<AveragedNodes, kMaxDepth> &to)
        : subtree_(subtree), set_(set), to_(to), depth_(subtree.depth), finest_(subtree.points),
          normals_(integer_normal_table().data()), linear_(linear_table().data()) {
        for (const StreamInfo &stream : streams_of(set_))
            if (traits_of(stream.kind).average == Average::mean)
                means_.push_back({.stream = stream,
                                  .finest = finest_.values(stream).data(),
                                  .scale = scale_to_byte(bits_per_point(stream, set_, depth_))});
    }

    // Averages the next node of `level` and everything below it.
    void node(int level, Sums &parent) {
        const auto index = static_cast<std::size_t>(cursors_[static_cast<std::size_t>(level)]++);
        Sums sums;
        const int count = kChildren[subtree_.masks[static_cast<std::size_t>(level)][index]];
        if (level + 1 == depth_) {
            std::uint64_t &cursor = cursors_[static_cast<std::size_t>(depth_)];
            sums.votes = static_cast<std::uint64_t>(count);
            for (const std::uint64_t end = cursor + sums.votes; cursor < end; ++cursor)
                add_point(static_cast<std::size_t>(cursor), sums);
        } else {
            for (int left = count; left > 0; --left)
                node(level + 1, sums);
        }
        store(level, index, sums, parent);
    }

    // Stores the averages of one node and adds its sums to its parent.
    void store(int level, std::size_t index, const Sums &sums, Sums &parent) {
        const AveragedNodes &to = to_[static_cast<std::size_t>(level)];
        PointAttributes &points = *to.points;
        index += to.first;
        const std::uint16_t normal = average_normal(sums);
        const std::uint8_t radius = covering(sums.child_radius, level);
        points.normals[index] = normal;
        points.radii[index] = radius;
        parent.votes += sums.votes;
        for (std::size_t c = 0; c < 3; ++c)
            parent.normal[c] += sums.normal[c];
        for (std::size_t c = 0; c < 6; ++c)
            parent.moment[c] += sums.moment[c];
        parent.two_sided |= (normal & kTwoSidedBit) != 0;
        parent.child_radius = std::max(parent.child_radius, radius);
        if (set_.colour != ColourFormat::none) {
            Rgb8 colour;
            for (std::size_t c = 0; c < 3; ++c) {
                colour[c] = linear_to_srgb(static_cast<std::uint32_t>(mean(sums.colour[c], sums.votes)));
                parent.colour[c] += sums.colour[c];
            }
            set_point_colour(points, index, set_.colour, colour);
        }
        if constexpr (kEverything)
            store_rest(points, level, index, sums, parent);
    }

  private:
    // Adds a point's values; the caller counts its vote.
    void add_point(std::size_t point, Sums &to) const {
        const std::uint16_t stored = finest_.normals[point];
        add_normal(normals_[stored & kNormalIndexMask], to);
        to.two_sided |= (stored & kTwoSidedBit) != 0;
        to.child_radius = std::max(to.child_radius, finest_.radii[point]);
        if (set_.colour != ColourFormat::none) {
            const Rgb8 colour = point_colour(finest_.colours, point, set_.colour);
            for (std::size_t c = 0; c < 3; ++c)
                to.colour[c] += linear_[colour[c]];
        }
        if constexpr (kEverything) {
            if (set_.material)
                to.materials[finest_.materials[point]] += 1;
            for (std::size_t i = 0; i < means_.size(); ++i)
                to.means[i] += means_[i].finest[point] * means_[i].scale;
        }
    }

    void store_rest(PointAttributes &points, int level, std::size_t index, const Sums &sums, Sums &parent) const {
        if (set_.material) {
            points.materials[index] = static_cast<std::uint8_t>(
                std::max_element(sums.materials.begin(), sums.materials.end()) - sums.materials.begin());
            for (std::size_t m = 0; m < kMaxMaterials; ++m)
                parent.materials[m] += sums.materials[m];
        }
        for (std::size_t i = 0; i < means_.size(); ++i) {
            const StreamInfo &stream = means_[i].stream;
            const std::uint64_t scale = scale_to_byte(bits_per_point(stream, set_, level));
            points.values(stream)[index] = static_cast<std::uint8_t>(mean(sums.means[i], sums.votes * scale));
            parent.means[i] += sums.means[i];
        }
    }

    // covering_radius with a cache (0: not cached; radii are never 0), since a level has few different radii.
    std::uint8_t covering(std::uint8_t child_radius, int level) {
        std::uint8_t &radius = covering_[static_cast<std::size_t>(level)][child_radius];
        if (radius == 0)
            radius = covering_radius(child_radius, level);
        return radius;
    }

    const Subtree &subtree_;
    const AttributeSet &set_;
    const std::array<AveragedNodes, kMaxDepth> &to_;
    int depth_;
    std::array<std::uint64_t, kMaxDepth + 1> cursors_{}; // next node of each level
    const PointView &finest_;
    const IntegerNormal *normals_;
    const std::uint16_t *linear_;
    struct Mean {
        StreamInfo stream;
        const std::uint8_t *finest;
        std::uint32_t scale; // scales its values to 0..255
    };
    std::vector<Mean> means_;
    std::array<std::array<std::uint8_t, 256>, kMaxDepth + 1> covering_{};
};

// Whether there are streams that only PointSums sums up.
bool needs_every_sum(const AttributeSet &set) {
    const StreamList streams = streams_of(set);
    return std::any_of(streams.begin(), streams.end(), [](const StreamInfo &stream) {
        const Average average = traits_of(stream.kind).average;
        return average == Average::vote || average == Average::mean;
    });
}

} // namespace

std::array<std::int64_t, 3> plane_normal(const CommonSums &sums) {
    const auto &m = sums.moment;
    const std::array<std::array<std::int64_t, 3>, 3> columns{
        {{m[0], m[1], m[2]}, {m[1], m[3], m[4]}, {m[2], m[4], m[5]}}};
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (columns[k][k] > columns[axis][axis])
            axis = k;
    return columns[axis];
}

void PointSums::add(const PointSums &other) {
    const auto add_all = [](auto &to, const auto &from) {
        std::transform(to.begin(), to.end(), from.begin(), to.begin(), std::plus<>());
    };
    votes += other.votes;
    add_all(normal, other.normal);
    add_all(moment, other.moment);
    add_all(colour, other.colour);
    child_radius = std::max(child_radius, other.child_radius);
    two_sided |= other.two_sided;
    add_all(materials, other.materials);
    add_all(means, other.means);
}

PointSums average_subtree(const Subtree &subtree, const AttributeSet &set,
                          const std::array<AveragedNodes, kMaxDepth> &to) {
    PointSums sums;
    if (needs_every_sum(set))
        Averager<PointSums>(subtree, set, to).node(subtree.level, sums);
    else
        Averager<CommonSums>(subtree, set, to).node(subtree.level, sums);
    return sums;
}

PointSums average_node(int level, int depth, const PointSums &sums, const AttributeSet &set, const AveragedNodes &to) {
    std::array<AveragedNodes, kMaxDepth> places{};
    places[static_cast<std::size_t>(level)] = to;
    PointSums parent;
    Averager<PointSums>({.level = level, .depth = depth}, set, places).store(level, 0, sums, parent);
    return parent;
}

// Averages the subtrees below one level in parallel, each into its own slots, then the few nodes above them.
void average_levels(Model &model, int threads) {
    const int depth = model.parameters.grid.depth;
    assert(model.levels.size() == static_cast<std::size_t>(depth) + 1);
    LevelMasks masks(model.levels.size());
    for (std::size_t level = 1; level < masks.size(); ++level)
        masks[level] = model.levels[level].masks;
    const AttributeSet &set = model.parameters.attributes;
    for (int level = 0; level < depth; ++level)
        model.levels[static_cast<std::size_t>(level)].points.resize(
            level == 0 ? 1 : static_cast<std::size_t>(count_children(masks[static_cast<std::size_t>(level)])), set);

    const int split_level = std::min(4, depth - 1);
    const auto starts = subtree_starts(masks, split_level);
    const auto count = [&](int level, std::size_t root) {
        const auto &of_level = starts[static_cast<std::size_t>(level)];
        return of_level[root + 1] - of_level[root];
    };
    std::vector<PointSums> sums(starts[static_cast<std::size_t>(split_level)].size() - 1);
    parallel_for(sums.size(), threads, [&](std::size_t root) {
        Subtree subtree{.level = split_level, .depth = depth};
        std::array<AveragedNodes, kMaxDepth> to{};
        for (int level = split_level; level < depth; ++level) {
            const auto l = static_cast<std::size_t>(level);
            subtree.masks[l] = slice(masks[l + 1], starts[l][root], count(level, root));
            to[l] = {&model.levels[l].points, static_cast<std::size_t>(starts[l][root])};
        }
        subtree.points = view_points(model.levels.back().points, static_cast<std::size_t>(starts.back()[root]),
                                     static_cast<std::size_t>(count(depth, root)), set);
        sums[root] = average_subtree(subtree, set, to);
    });

    SubtreeMerge<PointSums> merge;
    for (std::size_t root = 0; root < sums.size(); ++root) {
        NodeCounts counts{};
        for (int level = split_level; level <= depth; ++level)
            counts[static_cast<std::size_t>(level)] = count(level, root);
        merge.add(
            split_level, counts, sums[root],
            [&](int level, std::uint64_t index) {
                return masks[static_cast<std::size_t>(level) + 1][static_cast<std::size_t>(index)];
            },
            [](PointSums &parent, const PointSums &node, int, MortonCode) { parent.add(node); },
            [&](PointSums &node, int level, std::uint64_t index) {
                node = average_node(
                    level, depth, node, set,
                    {&model.levels[static_cast<std::size_t>(level)].points, static_cast<std::size_t>(index)});
            });
    }
    average_fields(model, threads);
}

void set_levels(Model &model, std::vector<MortonCode> codes, PointAttributes points, int threads,
                std::vector<Bytes> fields) {
    LevelMasks masks = encode_octree(codes, model.parameters.grid.depth);
    free_memory(codes);
    model.levels.assign(masks.size(), {});
    for (std::size_t level = 0; level < masks.size(); ++level)
        model.levels[level].masks = std::move(masks[level]);
    model.levels.back().points = std::move(points);
    model.levels.back().fields = std::move(fields);
    average_levels(model, threads);
}

} // namespace pbm
