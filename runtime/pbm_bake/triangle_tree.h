// The triangles that a model was made of, as a tree of boxes for shadow rays.
// Based on: Kay, Kajiya. Ray Tracing Complex Scenes. 1986 (boxes); Moeller, Trumbore. Fast, Minimum Storage
// Ray-Triangle Intersection. 1997; Ericson. Real-Time Collision Detection. 2005 (nearest point)
//
// Triangles are split at medians of their centres into blocks of powers of four, down to leaves of four. A node's
// number determines its children, so the tree stores boxes only. Coordinates are of any unit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace pbm {

using Position = std::array<float, 3>;

class TriangleTree {
  public:
    using Triangle = std::array<Position, 3>; // corners

    // Calls `triangle(i)` twice for each i < count, from several threads at once. count < 2^32.
    //
    // throws  std::bad_alloc
    TriangleTree(std::size_t count, const std::function<Triangle(std::size_t)> &triangle, int threads);

    bool empty() const { return leaves_.empty(); }

    // The position on a triangle nearest to `from`, if one is nearer than `within`.
    std::optional<Position> nearest(const Position &from, float within) const;

    // Whether a triangle intersects the segment from `from` to `from + reach * direction`.
    bool blocks(const Position &from, const Position &direction, float reach) const;

    // Scans of one surface from several sides overlap in layers. Returns the distance to the last layer, in lengths of
    // `direction`: the last triangle that faces the same way as the first one, before any that faces the opposite way.
    // Empty if the first one is farther than `start`.
    std::optional<float> last_layer(const Position &from, const Position &direction, float start, float reach) const;

  private:
    using Float4 = float __attribute__((vector_size(16)));
    using Float4x3 = std::array<Float4, 3>;
    struct Leaf {
        Float4x3 corner, first, second; // edges from that corner
    };
    struct Node {
        Float4x3 low, high; // of its children's boxes
    };
    struct Ray;
    struct Crossings;
    static void set_lane(Leaf &leaf, std::size_t lane, const Triangle &triangle);
    static Node boxes_of(const Leaf *leaves, std::size_t count);
    static Crossings cross_leaf(const Ray &ray, const Leaf &leaf);
    template <class Visit> bool visit_leaves(const Ray &ray, const Visit &visit) const;
    void add_layers(std::vector<Node> boxes);

    std::vector<Leaf> leaves_;
    std::vector<std::vector<Node>> layers_; // the last layer has one node; the first one's children are leaves
};

} // namespace pbm
