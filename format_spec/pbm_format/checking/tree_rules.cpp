#include "pbm_format/checking/tree_rules.h"

#include "system/threads/per_thread.h"

#include <utility>

namespace pbm {

namespace {

// Nodes of one level, counted within the level.
struct NodeRange {
    std::uint64_t first = 0, end = 0;
    std::uint64_t size() const { return end - first; }
};

// The nodes whose children are the nodes `below`; `masks` are those of the nodes from number `first` on, whose children
// begin with number `first_child`. None if `below` begins or ends within the children of a node.
std::optional<NodeRange> parents_of(const NodeRange &below, ByteView masks, std::uint64_t first,
                                    std::uint64_t first_child) {
    std::size_t node = 0;
    std::uint64_t child = first_child;
    const auto skip_to = [&](std::uint64_t end) {
        constexpr std::size_t kMany = 248; // masks that count_children sums up at once
        while (node + kMany <= masks.size() && child + 8 * kMany <= end) {
            child += count_children(masks.subspan(node, kMany));
            node += kMany;
        }
        while (node < masks.size() && child < end)
            child += kChildren[masks[node++]];
        return child == end;
    };
    NodeRange parents;
    if (!skip_to(below.first))
        return std::nullopt;
    parents.first = first + node;
    if (!skip_to(below.end))
        return std::nullopt;
    parents.end = first + node;
    return parents;
}

// The nodes of each level below the chunk's root, up to that level at which they are not whole families.
using Ranges = std::array<NodeRange, kMaxDepth + 1>;
bool find_ranges(const ChunkPath &path, int depth, Ranges &ranges) {
    const ChunkEntry &finest = *path.steps[static_cast<std::size_t>(depth)].entry;
    ranges[static_cast<std::size_t>(depth)] = {finest.first_point, finest.first_point + finest.shape.points};
    ranges[static_cast<std::size_t>(depth) - 1] = {finest.first_node, finest.first_node + finest.shape.nodes};
    for (std::size_t level = static_cast<std::size_t>(depth) - 1; level > finest.shape.root_depth; --level) {
        const ChunkPath::Step &step = path.steps[level];
        const auto parents = parents_of(ranges[level], step.masks, step.entry->first_node, step.entry->first_point);
        if (!parents)
            return false;
        ranges[level - 1] = *parents;
    }
    return ranges[finest.shape.root_depth].size() == 1;
}

void keep_first(std::optional<WrongAverage> &kept, std::optional<WrongAverage> &&other) {
    if (other && (!kept || other->point < kept->point))
        kept = std::move(other);
}

struct Averages {
    std::array<PointAttributes, kMaxDepth> points;
    std::array<Bytes, kMaxDepth> field;
};

PointView part(const PointView &points, std::uint64_t first, std::uint64_t count, const AttributeSet &set) {
    PointView part;
    for_columns(
        set,
        [&](const StreamInfo &, std::size_t width, const auto &from, auto &to) {
            to = from.subspan(width * static_cast<std::size_t>(first), width * static_cast<std::size_t>(count));
        },
        points, part);
    return part;
}

void check_averages(const TreeContext &context, const ChunkPath &path, const Ranges &ranges, MeasuredSubtree &result) {
    const auto depth = static_cast<std::size_t>(context.depth);
    const std::size_t root = path.steps[depth].entry->shape.root_depth;
    Subtree subtree{.level = static_cast<int>(root), .depth = context.depth, .points = path.steps[depth].points};
    auto &averages = per_thread<Averages>();
    std::array<AveragedNodes, kMaxDepth> to{};
    for (std::size_t level = root; level < depth; ++level) {
        const ChunkPath::Step &below = path.steps[level + 1];
        subtree.masks[level] = slice(below.masks, ranges[level].first - below.entry->first_node, ranges[level].size());
        averages.points[level].resize(static_cast<std::size_t>(ranges[level].size()), context.set);
        to[level] = {&averages.points[level], 0};
    }
    WrongAverages wrong;
    bool any = false;
    result.sums = average_subtree(subtree, context.set, to);
    for (std::size_t level = context.root_wrong && root == 0 ? 1 : root; level < depth; ++level) {
        const ChunkPath::Step &step = path.steps[level];
        const auto count = static_cast<std::size_t>(ranges[level].size());
        wrong.points[level] =
            find_wrong_average(context.points_at[level], static_cast<int>(level), ranges[level].first,
                               part(step.points, ranges[level].first - step.first_point(), count, context.set),
                               view_points(averages.points[level], 0, count, context.set), context.set);
        any |= wrong.points[level].has_value();
    }
    result.fields.clear();
    for (std::size_t f = 0; f < context.fields.size(); ++f) {
        const Field &field = context.fields[f];
        const Bytes &finest = path.steps[depth].fields[f];
        result.fields.push_back(sum_field(field, finest));
        average_field(field, subtree, finest, averages.field);
        for (std::size_t level = root; level < depth; ++level) {
            const ChunkPath::Step &step = path.steps[level];
            wrong.fields[level][f] =
                find_wrong_average(context.fields_at[level], static_cast<int>(level), ranges[level].first, field,
                                   slice(step.fields[f], field.bytes * (ranges[level].first - step.first_point()),
                                         field.bytes * ranges[level].size()),
                                   averages.field[level]);
            any |= wrong.fields[level][f].has_value();
        }
    }
    if (any)
        result.wrong = std::make_unique<WrongAverages>(std::move(wrong));
}

} // namespace

void WrongAverages::merge(WrongAverages &&other) {
    for (std::size_t level = 0; level < points.size(); ++level) {
        keep_first(points[level], std::move(other.points[level]));
        for (std::size_t f = 0; f < kMaxFields; ++f)
            keep_first(fields[level][f], std::move(other.fields[level][f]));
    }
}

MeasuredSubtree measure_subtree(const TreeContext &context, const ChunkPath &path) {
    MeasuredSubtree result;
    Ranges ranges;
    result.is_whole = find_ranges(path, context.depth, ranges);
    const ChunkPath::Step &finest = path.steps[static_cast<std::size_t>(context.depth)];
    if (!result.is_whole) {
        result.masks.assign(finest.masks.begin(), finest.masks.end());
        return result;
    }
    for (std::size_t level = finest.entry->shape.root_depth; level < ranges.size(); ++level)
        result.counts[level] = ranges[level].size();
    if (context.averages)
        check_averages(context, path, ranges, result);
    return result;
}

void TreeRules::add(const ChunkPath &path, MeasuredSubtree &&subtree) {
    const auto depth = static_cast<std::size_t>(context_.depth);
    const auto mask_of = [&](int level, std::uint64_t index) {
        const ChunkPath::Step &below = path.steps[static_cast<std::size_t>(level) + 1];
        return below.masks[static_cast<std::size_t>(index - below.entry->first_node)];
    };
    if (!subtree.is_whole) {
        all_whole_ = false;
        for (const std::uint8_t mask : subtree.masks) {
            NodeCounts counts{};
            counts[depth - 1] = 1;
            counts[depth] = kChildren[mask];
            split_.add(context_.depth - 1, counts, mask_of);
        }
        return;
    }
    const int level = path.steps[depth].entry->shape.root_depth;
    split_.add(level, subtree.counts, mask_of);
    if (!context_.averages || !all_whole_) // nobody asks for averages of a file with another split
        return;
    if (subtree.wrong)
        wrong_.merge(std::move(*subtree.wrong));
    above_.add(
        level, subtree.counts, {subtree.sums, std::move(subtree.fields)}, mask_of,
        [](Sums &parent, const Sums &node, int, MortonCode) {
            parent.points.add(node.points);
            parent.fields.resize(node.fields.size());
            for (std::size_t f = 0; f < node.fields.size(); ++f)
                parent.fields[f].add(node.fields[f]);
        },
        [&](Sums &sums, int of, std::uint64_t index) { average(path, of, index, sums); });
}

void TreeRules::average(const ChunkPath &path, int level, std::uint64_t index, Sums &sums) {
    const auto l = static_cast<std::size_t>(level);
    const ChunkPath::Step &step = path.steps[l];
    const std::uint64_t at = index - step.first_point();
    averaged_.resize(1, context_.set);
    sums.points = average_node(level, context_.depth, sums.points, context_.set, {&averaged_, 0});
    if (level > 0 || !context_.root_wrong)
        keep_first(wrong_.points[l],
                   find_wrong_average(context_.points_at[l], level, index, part(step.points, at, 1, context_.set),
                                      view_points(averaged_, 0, 1, context_.set), context_.set));
    for (std::size_t f = 0; f < context_.fields.size(); ++f) {
        const Field &field = context_.fields[f];
        Bytes computed(field.bytes);
        set_stored_value(computed, 0, field.bytes, average_field(field, sums.fields[f]));
        keep_first(wrong_.fields[l][f],
                   find_wrong_average(context_.fields_at[l], level, index, field,
                                      slice(step.fields[f], field.bytes * at, field.bytes), computed));
    }
}

} // namespace pbm
