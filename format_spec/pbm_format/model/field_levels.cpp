// Averages of fields over the coarser levels. BVG.md 17.3
#include "pbm_format/model/model.h"
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
        return votes == 0 ? 0 : static_cast<std::uint32_t>((2 * sum + votes) / (2 * votes));
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

void average_level(const Field &field, ByteView finest, const Starts &starts, int threads, Bytes &to) {
    constexpr std::size_t kNodes = 4096; // of one task
    const std::size_t nodes = starts.size() - 1;
    to.resize(nodes * field.bytes);
    parallel_for((nodes + kNodes - 1) / kNodes, threads, [&](std::size_t task) {
        const FieldAverager averager(field, finest);
        for (std::size_t node = task * kNodes; node < std::min(nodes, (task + 1) * kNodes); ++node)
            set_stored_value(to, node, field.bytes, averager.average(starts[node], starts[node + 1]));
    });
}

} // namespace

void average_fields(Model &model, int threads) {
    std::vector<Field> &fields = model.parameters.fields;
    Starts starts;
    for (std::size_t level = model.levels.size() - 1; level-- > 0 && !fields.empty();) {
        starts = starts_above(model.levels[level + 1].masks, starts);
        std::vector<Bytes> &columns = model.levels[level].fields;
        columns.resize(fields.size());
        for (std::size_t f = 0; f < fields.size(); ++f)
            average_level(fields[f], model.levels.back().fields[f], starts, threads, columns[f]);
    }
}

} // namespace pbm
