// Gathers the sides of coarser points from the finest ones. BVG.md 19.5
#include "pbm_format/levels/averages.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pbm {
namespace {

// Of |sum of normals| over its maximum: from here on all normals face one way.
constexpr double kOneWay = 0.75;
// Of a group's |sum of normals| over its maximum, and of the cosine between those of two sides.
constexpr double kLeastLength = 0.5, kMostCosine = -0.5;
// The smaller side has at least this share of a node.
constexpr std::uint64_t kLeastShare = 8; // one part of so many
// Sides that look less different than this are left out: their point shows both.
constexpr int kLeastColour = 24; // of 255, one channel
constexpr int kLeastLit = 64;    // of 255
// A level has none if fewer points would have some: parts of many models come close to each other somewhere.
constexpr std::size_t kLeastSides = 64, kLeastOfLevel = 2000; // points; one of so many points

double dot(const std::array<std::int64_t, 3> &a, const std::array<std::int64_t, 3> &b) {
    return static_cast<double>(a[0]) * static_cast<double>(b[0]) +
           static_cast<double>(a[1]) * static_cast<double>(b[1]) +
           static_cast<double>(a[2]) * static_cast<double>(b[2]);
}

// |sum of normals| over its maximum, squared.
double coherence(const CommonSums &sums) {
    const double most = 32767.0 * static_cast<double>(sums.votes);
    return dot(sums.normal, sums.normal) / (most * most);
}

// What lies below a node: all of it faces one way, or it has two sides.
struct NodeSides {
    std::array<PointSums, 2> sums;
    std::size_t count = 0;
};

// Whether the two groups of a node are the sides of a wall.
bool is_wall(const std::array<PointSums, 2> &sides) {
    const auto &[a, b] = sides;
    if (kLeastShare * std::min(a.votes, b.votes) < a.votes + b.votes ||
        std::min(coherence(a), coherence(b)) < kLeastLength * kLeastLength)
        return false;
    const double along = dot(a.normal, b.normal);
    return along < 0 && along * along > kMostCosine * kMostCosine * dot(a.normal, a.normal) * dot(b.normal, b.normal);
}

class SideGatherer {
  public:
    SideGatherer(const Model &model, std::span<const std::vector<std::uint64_t>> starts, int split_level)
        : model_(model), set_(model.parameters.attributes), depth_(model.parameters.grid.depth), starts_(starts),
          split_level_(split_level) {
        for (const StreamInfo &stream : streams_of(set_))
            if (traits_of(stream.kind).average == Average::mean)
                means_.push_back({stream, 255U / ((1U << bits_per_point(stream, set_, depth_)) - 1U)});
    }

    // Gathers the subtree with this number on the split level; `to`: of each level.
    NodeSides subtree(std::size_t root, std::vector<Sides> &to) {
        for (std::size_t level = static_cast<std::size_t>(split_level_); level < starts_.size(); ++level)
            cursors_[level] = starts_[level][root];
        const std::vector<std::uint32_t> &sided = finest_sides().points;
        next_side_ = static_cast<std::size_t>(
            std::lower_bound(sided.begin(), sided.end(), cursors_[static_cast<std::size_t>(depth_)]) - sided.begin());
        return node(split_level_, to);
    }

    // Gathers the nodes above the split level, whose own sides are `below`.
    void top(std::span<const NodeSides> below, std::vector<Sides> &to) {
        cursors_ = {};
        below_ = below;
        node(0, to);
        below_ = {};
    }

  private:
    const Sides &finest_sides() const { return model_.levels.back().sides; }

    NodeSides node(int level, std::vector<Sides> &to) {
        const auto l = static_cast<std::size_t>(level);
        const std::size_t index = static_cast<std::size_t>(cursors_[l]++);
        if (level == split_level_ && !below_.empty())
            return below_[index];
        const std::size_t first = stack_.size();
        const int count = kChildren[model_.levels[l + 1].masks[index]];
        PointSums all;
        for (int left = count; left > 0; --left) {
            if (level + 1 == depth_) {
                point(all);
                continue;
            }
            const NodeSides child = node(level + 1, to);
            for (std::size_t group = 0; group < child.count; ++group) {
                all.add(child.sums[group]);
                stack_.push_back(child.sums[group]);
            }
        }
        NodeSides sides = level + 1 == depth_ ? split_points(count, all) : split(first, all);
        stack_.resize(first);
        if (level > 0 && sides.count == 2 && is_wall(sides.sums))
            store(level, index, sides.sums, to[l]);
        return sides;
    }

    // Adds the next finest point, which counts once for each of its sides.
    void point(PointSums &to) {
        const auto index = static_cast<std::uint32_t>(cursors_[static_cast<std::size_t>(depth_)]++);
        const Sides &sides = finest_sides();
        if (next_side_ < sides.size() && sides.points[next_side_] == index) {
            add(sides.values, 2 * next_side_, to);
            add(sides.values, 2 * next_side_ + 1, to);
            ++next_side_;
        } else {
            add(model_.levels.back().points, index, to);
        }
    }

    void add(const PointAttributes &points, std::size_t i, PointSums &to) const {
        ++to.votes;
        add_normal(integer_normal_table()[points.normals[i] & kNormalIndexMask], to);
        if (set_.colour != ColourFormat::none) {
            const Rgb8 colour = point_colour(points.colours, i, set_.colour);
            for (std::size_t c = 0; c < 3; ++c)
                to.colour[c] += linear_table()[colour[c]];
        }
        if (set_.material)
            ++to.materials[points.materials[i]];
        for (std::size_t m = 0; m < means_.size(); ++m)
            to.means[m] += points.values(means_[m].stream)[i] * means_[m].scale;
    }

    // The sides of a node above the finest level but one: its children's groups are on the stack from `first` on.
    NodeSides split(std::size_t first, const PointSums &all) const {
        NodeSides sides{.sums = {all, {}}, .count = 1};
        if (coherence(all) >= kOneWay * kOneWay)
            return sides;
        const std::array<std::int64_t, 3> axis = plane_normal(all);
        std::array<PointSums, 2> halves;
        for (std::size_t i = first; i < stack_.size(); ++i)
            halves[dot(axis, stack_[i].normal) < 0 ? 1 : 0].add(stack_[i]);
        if (halves[0].votes > 0 && halves[1].votes > 0)
            sides = {halves, 2};
        return sides;
    }

    // The same for a node whose children are the last `count` finest points.
    NodeSides split_points(int count, const PointSums &all) {
        if (coherence(all) >= kOneWay * kOneWay)
            return {.sums = {all, {}}, .count = 1};
        const std::size_t first = stack_.size();
        const std::uint64_t end = cursors_[static_cast<std::size_t>(depth_)];
        const Sides &sides = finest_sides();
        std::size_t side = static_cast<std::size_t>(
            std::lower_bound(sides.points.begin(), sides.points.end(), end - static_cast<std::uint64_t>(count)) -
            sides.points.begin());
        for (std::uint64_t i = end - static_cast<std::uint64_t>(count); i < end; ++i) {
            if (side < sides.size() && sides.points[side] == i) {
                add(sides.values, 2 * side, stack_.emplace_back());
                add(sides.values, 2 * side + 1, stack_.emplace_back());
                ++side;
            } else {
                add(model_.levels.back().points, static_cast<std::size_t>(i), stack_.emplace_back());
            }
        }
        return split(first, all);
    }

    void store(int level, std::size_t index, const std::array<PointSums, 2> &sides, Sides &to) const {
        PointAttributes both;
        both.resize(2, set_);
        both.radii.clear();
        for (std::size_t side = 0; side < 2; ++side) {
            const PointSums &sums = sides[side];
            const auto mean = [&](std::uint64_t sum, std::uint64_t scale) {
                return (2 * sum + sums.votes * scale) / (2 * sums.votes * scale);
            };
            both.normals[side] = quantise_normal(sums.normal);
            if (set_.colour != ColourFormat::none) {
                Rgb8 colour;
                for (std::size_t c = 0; c < 3; ++c)
                    colour[c] = linear_to_srgb(static_cast<std::uint32_t>(mean(sums.colour[c], 1)));
                set_point_colour(both, side, set_.colour, colour);
            }
            if (set_.material)
                both.materials[side] = static_cast<std::uint8_t>(
                    std::max_element(sums.materials.begin(), sums.materials.end()) - sums.materials.begin());
            for (std::size_t m = 0; m < means_.size(); ++m) {
                const unsigned bits = bits_per_point(means_[m].stream, set_, level);
                both.values(means_[m].stream)[side] =
                    static_cast<std::uint8_t>(mean(sums.means[m], 255U / ((1U << bits) - 1U)));
            }
        }
        if (look_different(both, 0, model_.levels[static_cast<std::size_t>(level)].points, index, set_, level))
            append(both, static_cast<std::uint32_t>(index), to);
    }

    void append(const PointAttributes &both, std::uint32_t index, Sides &to) const {
        to.points.push_back(index);
        for_columns(
            set_,
            [](const StreamInfo &, std::size_t, auto &column, const auto &more) {
                column.insert(column.end(), more.begin(), more.end());
            },
            to.values, both);
    }

  public:
    // Whether the sides `2 i` and `2 i + 1` differ so much from each other, or in their light from their point, that it
    // cannot stand for both.
    static bool look_different(const PointAttributes &sides, std::size_t i, const PointAttributes &points,
                               std::size_t point, const AttributeSet &set, int level) {
        const std::size_t a = 2 * i, b = a + 1;
        if (set.colour != ColourFormat::none) {
            const Rgb8 one = point_colour(sides.colours, a, set.colour),
                       other = point_colour(sides.colours, b, set.colour);
            for (std::size_t c = 0; c < 3; ++c)
                if (std::abs(int{one[c]} - int{other[c]}) >= kLeastColour)
                    return true;
        }
        if (set.material && sides.materials[a] != sides.materials[b])
            return true;
        for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
            const int scale = 255 / ((1 << set.shadow_bits[light][static_cast<std::size_t>(level)]) - 1);
            const auto [least, most] =
                std::minmax({sides.shadows[light][a], sides.shadows[light][b], points.shadows[light][point]});
            if ((int{most} - int{least}) * scale >= kLeastLit)
                return true;
        }
        return false;
    }

  private:
    const Model &model_;
    const AttributeSet &set_;
    const int depth_;
    const std::span<const std::vector<std::uint64_t>> starts_;
    const int split_level_;
    struct Mean {
        StreamInfo stream;
        std::uint32_t scale; // scales its values to 0..255
    };
    std::vector<Mean> means_;
    std::array<std::uint64_t, kMaxDepth + 1> cursors_{}; // next node of each level
    std::size_t next_side_ = 0;                          // of the finest level
    std::span<const NodeSides> below_;
    std::vector<PointSums> stack_;
};

void append_sides(const Sides &from, const AttributeSet &set, Sides &to) {
    to.points.insert(to.points.end(), from.points.begin(), from.points.end());
    to.values.append(from.values, set);
}

// Removes the sides of points that show both of them.
void keep_different(const AttributeSet &set, int level, const PointAttributes &points, Sides &sides) {
    Sides kept;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        if (!SideGatherer::look_different(sides.values, i, points, sides.points[i], set, level))
            continue;
        kept.points.push_back(sides.points[i]);
        for_columns(
            set,
            [&](const StreamInfo &stream, std::size_t width, auto &column, const auto &from) {
                if (stream.kind != StreamKind::radius)
                    column.insert(column.end(), from.begin() + static_cast<std::ptrdiff_t>(2 * width * i),
                                  from.begin() + static_cast<std::ptrdiff_t>(2 * width * (i + 1)));
            },
            kept.values, sides.values);
    }
    sides = std::move(kept);
}

} // namespace

void gather_sides(Model &model, int threads) {
    const AttributeSet &set = model.parameters.attributes;
    // What look_different compares: without it no sides would be kept.
    if (set.colour == ColourFormat::none && !set.material && set.lights == 0) {
        for (Level &level : model.levels)
            level.sides = {};
        return;
    }
    const int depth = model.parameters.grid.depth;
    LevelMasks masks(model.levels.size());
    for (std::size_t level = 1; level < masks.size(); ++level)
        masks[level] = model.levels[level].masks;
    const int split_level = std::min(4, depth - 1);
    const auto starts = subtree_starts(masks, split_level);
    const std::size_t roots = starts[static_cast<std::size_t>(split_level)].size() - 1;
    std::vector<NodeSides> below(roots);
    std::vector<std::vector<Sides>> found(roots);
    parallel_for(roots, threads, [&](std::size_t root) {
        found[root].resize(model.levels.size());
        below[root] = SideGatherer(model, starts, split_level).subtree(root, found[root]);
    });
    std::vector<Sides> above(model.levels.size());
    SideGatherer(model, starts, split_level).top(below, above);
    for (std::size_t level = 1; level < model.levels.size() - 1; ++level) {
        Sides &to = model.levels[level].sides;
        to = std::move(above[level]);
        for (const std::vector<Sides> &of_subtree : found)
            append_sides(of_subtree[level], set, to);
    }
    keep_different(set, depth, model.levels.back().points, model.levels.back().sides);
    for (Level &level : model.levels)
        if (level.sides.size() < std::max<std::size_t>(kLeastSides, level.points.size() / kLeastOfLevel))
            level.sides = {};
}

} // namespace pbm
