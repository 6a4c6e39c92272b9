#include "pbm_format/brick_index.h"

#include <algorithm>
#include <bit>

namespace pbm {

BrickParents brick_parents(const ChunkEntry &entry, const ChunkEntry &above, std::span<const BrickRecord> bricks,
                           ByteView masks) {
    assert(entry.first_parent >= above.first_node);
    return {.bricks = bricks, .masks = masks, .first = entry.first_parent - above.first_node};
}

namespace {

// Octants of the bricks above, one after the other: a brick of level L - 1 is a node of level L - 4, whose children
// are bricks of level L. Byte k of its map holds the nodes of level L - 2 in child k, each of which has a mask.
class OctantWalk {
  public:
    explicit OctantWalk(const BrickParents &parents) : parents_(parents) {
        const auto after =
            std::upper_bound(parents.bricks.begin(), parents.bricks.end(), parents.first,
                             [](std::size_t first, const BrickRecord &brick) { return first < brick.first_node; });
        brick_ = std::max<std::size_t>(static_cast<std::size_t>(after - parents.bricks.begin()), 1) - 1;
        if (brick_ < parents.bricks.size())
            node_ = parents.bricks[brick_].first_node;
    }

    std::size_t node() const { return node_; } // the next one's first mask

    // Place and node map of the next occupied octant, which is a brick of the level below; false at the end.
    bool next(BrickRecord &to) {
        for (; brick_ < parents_.bricks.size(); ++brick_, octant_ = 0) {
            const BrickRecord &above = parents_.bricks[brick_];
            while (octant_ < 8) {
                const unsigned k = octant_++;
                auto occupied = static_cast<unsigned>(above.node_map >> 8 * k & 255);
                if (occupied == 0)
                    continue;
                if (node_ > parents_.masks.size() ||
                    parents_.masks.size() - node_ < static_cast<std::size_t>(std::popcount(occupied)))
                    return false;
                to.x = static_cast<std::uint16_t>(2U * above.x + (k & 1));
                to.y = static_cast<std::uint16_t>(2U * above.y + (k >> 1 & 1));
                to.z = static_cast<std::uint16_t>(2U * above.z + (k >> 2));
                to.node_map = 0;
                for (; occupied != 0; occupied &= occupied - 1)
                    to.node_map |= std::uint64_t{parents_.masks[node_++]} << 8 * std::countr_zero(occupied);
                return true;
            }
        }
        return false;
    }

  private:
    const BrickParents &parents_;
    std::size_t brick_ = 0, node_ = 0;
    unsigned octant_ = 0;
};

// x, y, z and node_map of every record.
bool place_bricks(const BrickParents &parents, const ChunkShape &shape, std::span<BrickRecord> to) {
    if (shape.parents == 0) { // level 1: the cube itself, and in it the one node of level 0
        to[0].x = to[0].y = to[0].z = 0;
        to[0].node_map = 1;
        return to.size() == 1;
    }
    OctantWalk walk(parents);
    BrickRecord before;
    while (walk.node() < parents.first)
        if (!walk.next(before))
            return false;
    if (walk.node() != parents.first)
        return false;
    for (BrickRecord &brick : to)
        if (!walk.next(brick))
            return false;
    return walk.node() == parents.first + shape.parents;
}

// Below the root, if each is: bricks ascend, so the first and the last tell.
bool below_root(const ChunkShape &shape, int brick_level, const BrickRecord &brick) {
    return morton_encode(brick.x, brick.y, brick.z) >> 3 * (brick_level - shape.root_depth) == shape.root_prefix;
}

// Cone, two-sidedness and radius of the points of one brick.
void bound_points(std::span<const std::uint16_t> normals, ByteView radii, BrickRecord &to) {
    const std::span<const IntegerNormal> table = integer_normal_table();
    std::array<std::int32_t, 3> sum{}; // of at most 512 x 32,767
    unsigned bits = 0;
    for (const std::uint16_t stored : normals) {
        const IntegerNormal &n = table[stored & kNormalIndexMask];
        bits |= stored;
        for (std::size_t c = 0; c < 3; ++c)
            sum[c] += n[c];
    }
    NormalCone cone;
    const bool two_sided = (bits & kTwoSidedBit) != 0;
    if (!two_sided) {
        const std::uint16_t index = quantise_normal(sum[0], sum[1], sum[2]);
        const IntegerNormal axis = table[index];
        std::int32_t least = 32767 * 32767;
        for (const std::uint16_t stored : normals) {
            const IntegerNormal &n = table[stored & kNormalIndexMask];
            least = std::min(least, axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2]);
        }
        const std::int32_t cosine = least / 32767 - (least % 32767 < 0 ? 1 : 0); // rounded down
        if (cosine > kNoCone)
            cone = {.axis = index, .cosine = static_cast<std::int16_t>(cosine)};
    }
    to.cone_axis = cone.axis;
    to.cone_cosine = cone.cosine;
    to.flags = two_sided ? kTwoSidedBrick : std::uint8_t{0};
    std::uint8_t largest = 0;
    for (const std::uint8_t radius : radii)
        largest = std::max(largest, radius);
    to.largest_radius = largest;
}

} // namespace

bool index_bricks(const BrickParents &parents, const ChunkShape &shape, int level, ByteView masks,
                  std::span<const std::uint16_t> normals, ByteView radii, std::span<BrickRecord> to) {
    assert(to.size() == shape.bricks && !to.empty());
    const int brick_level = std::max(0, level - 3);
    if (!place_bricks(parents, shape, to) || !below_root(shape, brick_level, to.front()) ||
        !below_root(shape, brick_level, to.back()))
        return false;
    std::size_t node = 0, point = 0;
    for (BrickRecord &brick : to) {
        const auto nodes = static_cast<std::size_t>(std::popcount(brick.node_map));
        if (masks.size() - node < nodes)
            return false;
        const std::size_t points = count_children(masks.subspan(node, nodes));
        if (normals.size() - point < points || radii.size() - point < points)
            return false;
        brick.first_node = static_cast<std::uint16_t>(node);
        brick.first_point = static_cast<std::uint16_t>(point);
        bound_points(normals.subspan(point, points), radii.subspan(point, points), brick);
        node += nodes;
        point += points;
    }
    return node == masks.size() && point == normals.size();
}

} // namespace pbm
