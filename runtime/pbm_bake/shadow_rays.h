// Shadows by rays against the triangles that a model was made of. They are available while the model is built.
//
// Points alone do not say where the surface lies within a voxel: on rough scans 2 to 3 % of the points that face a
// light get wrong shadows. Triangles say it, and they hold the relief between points that blocks the light.
// Stability: experimental.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace pbm {

class ShadowCasters;
struct LevelBrick;
struct LightPlace; // light_view.h

using Position = std::array<float, 3>;

// The triangles that a model was made of, as a tree of boxes for shadow rays.
// Based on: Kay, Kajiya. Ray Tracing Complex Scenes. 1986 (boxes); Moeller, Trumbore. Fast, Minimum Storage
// Ray-Triangle Intersection. 1997; Ericson. Real-Time Collision Detection. 2005 (nearest point)
//
// Triangles are split at medians of their centres into blocks of powers of four, down to leaves of four. A node's
// number determines its children, so the tree stores boxes only. Coordinates are of any unit.
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

class ShadowRays {
  public:
    static constexpr float kLift = 0.25F; // voxels

    // `casters` and `triangles` must outlive this object.
    // `lift`, voxels: how far off the surface the rays start.
    ShadowRays(const ShadowCasters &casters, const TriangleTree &triangles, int threads, float lift = kLift);

    // Whether every point lies on a triangle of its voxel. Otherwise the model is more than these triangles, and rays
    // would pass through the rest of it.
    bool complete() const { return complete_; }

    // A block of bricks is the unit of parallel work.
    std::size_t blocks() const;

    // For each point of a block, counts the parts of a light that a ray reaches, from the side of the point that faces
    // the light; 0 if that is the back of a point without two sides. Parts are
    // lights without size, in an order that spreads the first of them well: where those agree, the others are skipped.
    // A ray starts `lift` off the surface, along the point's normal: voxels do not hold relief lower than kLift.
    // The surface is the position on the triangles nearest to the voxel's centre. Where scans overlap in layers up to
    // two voxels apart, it is the outermost layer, which is what is seen.
    void vote(std::size_t block, std::span<const LightPlace> parts, std::span<std::uint8_t> votes) const;

  private:
    struct Offset {
        std::int8_t x, y, z; // from the voxel's centre, in kOffsetSteps-ths of a voxel
        std::uint8_t layers; // of the outermost layer along the normal, in kLayerSteps-ths of a voxel
    };
    struct Start {
        Position front, back, normal; // on the outermost layer, and on the surface
        bool two_sides;
    };
    bool reached(const Start &from, const LightPlace &light) const;

    const ShadowCasters &casters_;
    const TriangleTree &triangles_;
    const float lift_;
    std::vector<Offset> offsets_; // [points]
    bool complete_ = true;
};

} // namespace pbm
