// Computes the averages of the coarser levels. BVG.md 7
#include "pbm_format/model/model.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <compare>
#include <cstdlib>
#include <initializer_list>
#include <type_traits>

namespace pbm {

namespace {

// Sums over the finest points below one node, for streams that nearly every model has. The sums fit into 63 bits: at
// most 2^32 votes of at most 2^30.
struct CommonSums {
    std::uint64_t votes = 0;
    std::array<std::int64_t, 3> normal{};
    std::array<std::int64_t, 6> moment{}; // of the normals: xx xy xz yy yz zz
    std::array<std::uint64_t, 3> colour{};
    std::uint8_t child_radius = 0; // largest among the children
    bool two_sided = false;        // any child is
};

// Adds the sums of the remaining streams.
struct EverySum : CommonSums {
    std::array<std::uint64_t, kMaxMaterials> materials{}; // votes
    std::array<std::uint64_t, kMaxStreams> means{};       // of the model's streams, scaled to 8 bits
};

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
    const auto &m = sums.moment;
    const std::array<std::array<std::int64_t, 3>, 3> columns{
        {{m[0], m[1], m[2]}, {m[1], m[3], m[4]}, {m[2], m[4], m[5]}}};
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (columns[k][k] > columns[axis][axis])
            axis = k;
    // Of the plane's two normals, take the one on the side of the sum: an only child's normal then stays the same.
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c)
        along += static_cast<double>(columns[axis][c]) * static_cast<double>(sums.normal[c]);
    std::array<std::int64_t, 3> normal = columns[axis];
    if (along < 0)
        for (std::int64_t &component : normal)
            component = -component;
    return quantise_normal(normal) | kTwoSidedBit;
}

// Averages nodes depth first, with one cursor per level.
template <class Sums> class Averager {
    static constexpr bool kEverything = std::is_same_v<Sums, EverySum>;

  public:
    Averager(Model &model, std::vector<std::uint64_t> cursors)
        : model_(model), set_(model.parameters.attributes), depth_(static_cast<int>(model.levels.size()) - 1),
          cursors_(std::move(cursors)), finest_(model.levels.back().points), normals_(integer_normal_table().data()),
          linear_(linear_table().data()) {
        for (const StreamInfo &stream : streams_of(set_))
            if (traits_of(stream.kind).average == Average::mean)
                means_.push_back({.stream = stream,
                                  .finest = finest_.values(stream).data(),
                                  .scale = scale_to_byte(bits_per_point(stream, set_, depth_))});
    }

    // Averages the next node of `level` and everything below it, down to the finest level or to `last_level`, whose
    // sums by node index are in `finished`.
    void node(int level, const std::vector<Sums> *finished, int last_level, Sums &parent) {
        const auto index = static_cast<std::size_t>(cursors_[static_cast<std::size_t>(level)]++);
        Sums sums;
        if (level == last_level && finished != nullptr)
            sums = (*finished)[index];
        else
            add_children(level, index, finished, last_level, sums);
        store(level, index, sums, parent);
    }

    // Returns the sums of one node whose children are done, without storing them.
    Sums below(int level) {
        Sums sums;
        add_children(level, static_cast<std::size_t>(cursors_[static_cast<std::size_t>(level)]++), nullptr, depth_,
                     sums);
        return sums;
    }

  private:
    void add_children(int level, std::size_t index, const std::vector<Sums> *finished, int last_level, Sums &sums) {
        const int count = kChildren[model_.levels[static_cast<std::size_t>(level) + 1].masks[index]];
        if (level + 1 == depth_ && finished == nullptr) {
            std::uint64_t &cursor = cursors_[static_cast<std::size_t>(depth_)];
            sums.votes = static_cast<std::uint64_t>(count);
            for (const std::uint64_t end = cursor + sums.votes; cursor < end; ++cursor)
                add_point(static_cast<std::size_t>(cursor), sums);
        } else {
            for (int left = count; left > 0; --left)
                node(level + 1, finished, last_level, sums);
        }
    }

    // Adds a point's values; the caller counts its vote.
    void add_point(std::size_t point, Sums &to) const {
        const std::uint16_t stored = finest_.normals[point];
        const IntegerNormal &n = normals_[stored & kNormalIndexMask];
        for (std::size_t c = 0; c < 3; ++c)
            to.normal[c] += n[c];
        const std::array<std::int32_t, 6> products{n[0] * n[0], n[0] * n[1], n[0] * n[2],
                                                   n[1] * n[1], n[1] * n[2], n[2] * n[2]};
        for (std::size_t c = 0; c < 6; ++c)
            to.moment[c] += products[c];
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

    // Stores the averages of one node and adds its sums to its parent.
    void store(int level, std::size_t index, const Sums &sums, Sums &parent) {
        PointAttributes &points = model_.levels[static_cast<std::size_t>(level)].points;
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

    Model &model_;
    const AttributeSet &set_;
    int depth_;
    std::vector<std::uint64_t> cursors_; // next node of each level
    const PointAttributes &finest_;
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

// Averages the subtrees below one level in parallel, each into its own slots, then the few nodes above them.
template <class Sums> void average_masks(Model &model, const LevelMasks &masks, int threads) {
    const int split_level = std::min(4, model.parameters.grid.depth - 1);
    const auto starts = subtree_starts(masks, split_level);
    const std::size_t roots = starts[static_cast<std::size_t>(split_level)].size() - 1;
    std::vector<Sums> split_sums(roots);
    parallel_for(roots, threads, [&](std::size_t root) {
        std::vector<std::uint64_t> cursors(masks.size(), 0);
        for (std::size_t level = static_cast<std::size_t>(split_level); level < masks.size(); ++level)
            cursors[level] = starts[level][root];
        split_sums[root] = Averager<Sums>(model, std::move(cursors)).below(split_level);
    });
    Sums whole;
    Averager<Sums>(model, std::vector<std::uint64_t>(masks.size(), 0)).node(0, &split_sums, split_level, whole);
}

} // namespace

void average_levels(Model &model, int threads) {
    const int depth = model.parameters.grid.depth;
    assert(model.levels.size() == static_cast<std::size_t>(depth) + 1);
    LevelMasks masks(model.levels.size());
    for (std::size_t level = 1; level < masks.size(); ++level)
        masks[level] = model.levels[level].masks;
    for (int level = 0; level < depth; ++level)
        model.levels[static_cast<std::size_t>(level)].points.resize(
            level == 0 ? 1 : static_cast<std::size_t>(count_children(masks[static_cast<std::size_t>(level)])),
            model.parameters.attributes);

    const AttributeSet &set = model.parameters.attributes;
    const StreamList streams = streams_of(set);
    if (std::any_of(streams.begin(), streams.end(), [](const StreamInfo &stream) {
            const Average average = traits_of(stream.kind).average;
            return average == Average::vote || average == Average::mean;
        }))
        average_masks<EverySum>(model, masks, threads);
    else
        average_masks<CommonSums>(model, masks, threads);
    average_fields(model, threads);
}

} // namespace pbm
