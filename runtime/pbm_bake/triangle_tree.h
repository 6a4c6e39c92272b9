// The triangles that a model was made of, for shadow rays.
// Based on: Kay, Kajiya. Ray Tracing Complex Scenes. 1986 (boxes); Moeller, Trumbore. Fast, Minimum Storage
// Ray-Triangle Intersection. 1997; Ericson. Real-Time Collision Detection. 2005 (nearest point)
//
// Triangles are split at medians of their centres, into blocks of powers of four, down to leaves of four: a node's
// children follow from its number, so that the tree holds boxes only. Coordinates are of any unit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace pbm {

using Place = std::array<float, 3>;

class TriangleTree {
  public:
    using Triangle = std::array<Place, 3>; // corners

    // `triangle(i)` is asked twice for each i < count, from several threads at a time. count < 2^32.
    //
    // throws  std::bad_alloc
    TriangleTree(std::size_t count, const std::function<Triangle(std::size_t)> &triangle, int threads);

    bool empty() const { return leaves_.empty(); }

    // The place on a triangle that is nearest to `from`, if there is one nearer than `within`.
    std::optional<Place> nearest(const Place &from, float within) const;

    // Whether a triangle lies on the way from `from` to `from + reach * direction`.
    bool blocks(const Place &from, const Place &direction, float reach) const;

    // Scans of one surface from several sides lie over each other in layers. How far along the ray, in lengths of
    // `direction`, the last layer lies: the last triangle that faces the way the first one does, before any that faces
    // against it. Nothing if the first one is farther than `start`.
    std::optional<float> last_layer(const Place &from, const Place &direction, float start, float reach) const;

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
    std::vector<std::vector<Node>> layers_; // the last one has one node; those of the first have leaves as children
};

} // namespace pbm
