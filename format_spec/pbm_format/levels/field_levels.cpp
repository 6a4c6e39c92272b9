// Averages of fields over the coarser levels. BVG.md 17.3
#include "pbm_format/levels/averages.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <algorithm>

namespace pbm {

namespace {

// Index of the first point of the finest level below each node of a level, and the number of points.
using Starts = std::vector<std::uint64_t>;

// `below`: those of the level whose masks are `masks`; empty: that level is the finest.
Starts starts_above(ByteView masks, const Starts &below) {
    Starts starts(masks.size() + 1);
    std::uint64_t child = 0;
    for (std::size_t node = 0; node <= masks.size(); ++node) {
        starts[node] = below.empty() ? child : below[static_cast<std::size_t>(child)];
        child += node < masks.size() ? kChildren[masks[node]] : 0U;
    }
    return starts;
}

std::uint32_t rounded_mean(std::uint64_t sum, std::uint64_t votes) {
    return votes == 0 ? 0 : static_cast<std::uint32_t>((2 * sum + votes) / (2 * votes));
}

// How often each stored value occurs. All counts are 0 between two uses.
struct Histogram {
    std::vector<std::uint32_t> counts;
};

class FieldAverager {
  public:
    FieldAverager(const Field &field, ByteView finest)
        : field_(field), finest_(finest), histogram_(per_thread<Histogram>()) {
        histogram_.counts.resize(std::max<std::size_t>(histogram_.counts.size(), field.max_stored() + 1));
    }

    // Of the points `first` to `end` - 1 that have a value; 0: none has.
    std::uint32_t average(std::uint64_t first, std::uint64_t end) const {
        switch (field_.average) {
        case FieldAverage::mean: return mean(first, end);
        case FieldAverage::majority: return majority(first, end);
        case FieldAverage::maximum: return maximum(first, end);
        }
        return 0;
    }

  private:
    std::uint32_t at(std::uint64_t point) const {
        return stored_value(finest_, static_cast<std::size_t>(point), field_.bytes);
    }
    std::uint32_t mean(std::uint64_t first, std::uint64_t end) const {
        std::uint64_t sum = 0, votes = 0;
        for (std::uint64_t point = first; point < end; ++point) {
            const std::uint32_t value = at(point);
            sum += value;
            votes += value != 0 ? 1 : 0;
        }
        return rounded_mean(sum, votes);
    }
    std::uint32_t majority(std::uint64_t first, std::uint64_t end) const {
        std::uint32_t best = 0;
        std::vector<std::uint32_t> &counts = histogram_.counts;
        for (std::uint64_t point = first; point < end; ++point)
            ++counts[at(point)];
        for (std::uint64_t point = first; point < end; ++point) {
            const std::uint32_t value = at(point);
            if (value != 0 &&
                (best == 0 || counts[value] > counts[best] || (counts[value] == counts[best] && value < best)))
                best = value;
        }
        for (std::uint64_t point = first; point < end; ++point)
            counts[at(point)] = 0;
        return best;
    }
    std::uint32_t maximum(std::uint64_t first, std::uint64_t end) const {
        std::uint32_t highest = 0;
        for (std::uint64_t point = first; point < end; ++point)
            highest = std::max(highest, at(point));
        return highest;
    }

    const Field &field_;
    ByteView finest_;
    Histogram &histogram_;
};

void average_nodes(const Field &field, ByteView finest, const Starts &starts, std::size_t first, std::size_t end,
                   Bytes &to) {
    const FieldAverager averager(field, finest);
    for (std::size_t node = first; node < end; ++node)
        set_stored_value(to, node, field.bytes, averager.average(starts[node], starts[node + 1]));
}

} // namespace

void FieldSums::add(const FieldSums &other) {
    sum += other.sum;
    votes += other.votes;
    highest = std::max(highest, other.highest);
    counts.resize(std::max(counts.size(), other.counts.size()));
    for (std::size_t value = 0; value < other.counts.size(); ++value)
        counts[value] += other.counts[value];
}

FieldSums sum_field(const Field &field, ByteView stored) {
    FieldSums sums;
    const bool counts = field.average == FieldAverage::majority;
    sums.counts.resize(counts ? field.max_stored() + 1 : 0);
    for (std::size_t point = 0; point < stored.size() / field.bytes; ++point) {
        const std::uint32_t value = stored_value(stored, point, field.bytes);
        sums.sum += value;
        sums.votes += value != 0 ? 1 : 0;
        sums.highest = std::max(sums.highest, value);
        if (counts && value != 0)
            ++sums.counts[value];
    }
    return sums;
}

std::uint32_t average_field(const Field &field, const FieldSums &sums) {
    if (field.average == FieldAverage::mean)
        return rounded_mean(sums.sum, sums.votes);
    if (field.average == FieldAverage::maximum || sums.votes == 0)
        return sums.highest;
    return static_cast<std::uint32_t>(std::max_element(sums.counts.begin(), sums.counts.end()) - sums.counts.begin());
}

void average_field(const Field &field, const Subtree &subtree, ByteView stored, std::array<Bytes, kMaxDepth> &to) {
    Starts starts;
    for (int level = subtree.depth - 1; level >= subtree.level; --level) {
        const auto l = static_cast<std::size_t>(level);
        starts = starts_above(subtree.masks[l], starts);
        to[l].resize(subtree.masks[l].size() * field.bytes);
        average_nodes(field, stored, starts, 0, subtree.masks[l].size(), to[l]);
    }
}

void average_fields(Model &model, int threads) {
    std::vector<Field> &fields = model.parameters.fields;
    Starts starts;
    for (std::size_t level = model.levels.size() - 1; level-- > 0 && !fields.empty();) {
        starts = starts_above(model.levels[level + 1].masks, starts);
        std::vector<Bytes> &columns = model.levels[level].fields;
        columns.resize(fields.size());
        const std::size_t nodes = starts.size() - 1;
        for (std::size_t f = 0; f < fields.size(); ++f) {
            columns[f].resize(nodes * fields[f].bytes);
            parallel_blocks(nodes, 4096, threads, [&](std::size_t first, std::size_t end) {
                average_nodes(fields[f], model.levels.back().fields[f], starts, first, end, columns[f]);
            });
        }
    }
}

} // namespace pbm
