// Merges the subtrees of an octree, which come one after the other in Morton order, into the nodes above them. Holds
// the path from the root to the next subtree, and nothing else of the octree.
#pragma once

#include "pbm_format/model/octree.h"

#include <array>
#include <utility>
#include <vector>

namespace pbm {

// Numbers of nodes below and with the root of a subtree, by level.
using NodeCounts = std::array<std::uint64_t, kMaxDepth + 1>;

// `Value` is what is known of a node from the nodes below it.
template <class Value> class SubtreeMerge {
  public:
    // Adds the next subtree: its root lies on `level`, it has `counts` nodes.
    //
    //   mask_of(level, index)              the child mask, not 0, of the node with this number in its level
    //   join(parent, value, level, code)   adds a node's value to that of its parent; level and Morton code of the node
    //   close(value, level, index)         all children of this node were joined
    template <class MaskOf, class Join, class Close>
    void add(int level, const NodeCounts &counts, Value value, const MaskOf &mask_of, const Join &join,
             const Close &close) {
        while (static_cast<int>(open_.size()) < level) {
            const std::size_t here = open_.size();
            const MortonCode code = here == 0 ? 0 : next_code();
            const std::uint64_t index = next_[here]++;
            open_.push_back({Value{}, mask_of(static_cast<int>(here), index), code, index});
        }
        for (std::size_t below = static_cast<std::size_t>(level); below < counts.size(); ++below)
            next_[below] += counts[below];
        for (; level > 0; --level) {
            Node &parent = open_.back();
            join(parent.value, value, level, next_code());
            parent.mask &= static_cast<std::uint8_t>(parent.mask - 1);
            if (parent.mask != 0)
                return;
            value = std::move(parent.value);
            const std::uint64_t index = parent.index;
            open_.pop_back();
            close(value, level - 1, index);
        }
    }

  private:
    struct Node {
        Value value;
        std::uint8_t mask; // children that were not joined yet
        MortonCode code;
        std::uint64_t index;
    };

    // The code of the first child that was not joined yet.
    MortonCode next_code() const {
        return open_.back().code << 3 | static_cast<unsigned>(std::countr_zero(unsigned{open_.back().mask}));
    }

    std::vector<Node> open_; // [level]: from the root down
    NodeCounts next_{};      // number of the next node of each level
};

} // namespace pbm
