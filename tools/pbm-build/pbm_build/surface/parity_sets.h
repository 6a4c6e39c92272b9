// Disjoint sets of points with known relative signs: union-find with a parity.
// Based on: Galler, Fischer. An Improved Equivalence Algorithm. 1964
#pragma once

#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

namespace pbm::build {

class ParitySets {
  public:
    // `count` sets of one element, at most 2^31.
    explicit ParitySets(std::size_t count) : up_(count) {
        assert(count <= (std::size_t{1} << 31));
        for (std::size_t i = 0; i < count; ++i)
            up_[i] = static_cast<std::uint32_t>(i) << 1;
    }

    // An element's set, named by its root, and its sign in it.
    struct Member {
        std::uint32_t root;
        bool opposite; // to the sign of the root
    };
    Member find(std::uint32_t element) {
        std::uint32_t root = element;
        std::uint32_t parity = 0;
        while (up_[root] >> 1 != root) {
            parity ^= up_[root] & 1;
            root = up_[root] >> 1;
        }
        for (std::uint32_t at = element, left = parity; at != root;) { // path compression
            const std::uint32_t next = up_[at];
            up_[at] = root << 1 | left;
            left ^= next & 1;
            at = next >> 1;
        }
        return {root, parity != 0};
    }

    // True for most neighbours of one set; false tells nothing.
    bool share_parent(std::uint32_t a, std::uint32_t b) const { return up_[a] >> 1 == up_[b] >> 1; }

    // Joins the sets of two elements with opposite or equal signs. False if they were one set before. The lower root
    // remains.
    bool join(std::uint32_t a, std::uint32_t b, bool opposite) {
        if (share_parent(a, b))
            return false;
        Member p = find(a), q = find(b);
        if (p.root == q.root)
            return false;
        if (p.root > q.root)
            std::swap(p, q);
        up_[q.root] = p.root << 1 | static_cast<std::uint32_t>((p.opposite != q.opposite) != opposite);
        return true;
    }

  private:
    std::vector<std::uint32_t> up_; // [elements] parent << 1 | opposite to it
};

} // namespace pbm::build
