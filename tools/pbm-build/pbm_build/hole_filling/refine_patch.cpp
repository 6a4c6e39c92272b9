#include "pbm_build/hole_filling/refine_patch.h"

#include "pbm_build/surface/half_edge.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace pbm::build {
namespace {

// Swaps in space, unlike those in a plane, may go on for ever.
constexpr int kMaxPasses = 64;

class Refinement {
  public:
    Refinement(const Rim &rim, const std::vector<PatchTriangle> &triangles) : rim_(rim) {
        for (const RimVertex &vertex : rim.vertices) {
            positions_.push_back(vertex.position);
            spacing_.push_back(vertex.edge_length);
        }
        for (const PatchTriangle &triangle : triangles)
            from_.insert(from_.end(), triangle.begin(), triangle.end());
        find_mates();
    }

    void run() {
        const std::size_t rim = rim_.vertices.size(), enough = 2 * rim + rim * rim / 6;
        for (std::size_t before = 0; before != positions_.size() && positions_.size() < enough;) {
            before = positions_.size();
            const std::size_t triangles = from_.size() / 3;
            for (std::size_t i = 0; i < triangles; ++i)
                split_if_sparse(static_cast<HalfEdge>(3 * i));
            for (int pass = 0; pass < kMaxPasses && relax_all(); ++pass) {
            }
        }
    }

    Patch patch() const {
        Patch patch{.positions = positions_, .triangles = {}, .rim = rim_.vertices.size()};
        for (std::size_t i = 0; i < from_.size(); i += 3)
            patch.triangles.push_back({from_[i], from_[i + 1], from_[i + 2]});
        return patch;
    }

  private:
    std::uint32_t to(HalfEdge h) const { return from_[next_side(h)]; }

    void find_mates() {
        std::vector<HalfEdge> sides(from_.size());
        for (HalfEdge h = 0; h < sides.size(); ++h)
            sides[h] = h;
        const auto ends = [&](HalfEdge h) { return std::minmax({from_[h], to(h)}); };
        std::sort(sides.begin(), sides.end(),
                  [&](HalfEdge g, HalfEdge h) { return std::tuple(ends(g), g) < std::tuple(ends(h), h); });
        mates_.assign(from_.size(), kBoundary);
        for (std::size_t i = 1; i < sides.size(); ++i)
            if (ends(sides[i - 1]) == ends(sides[i]))
                join(sides[i - 1], sides[i]);
    }

    void join(HalfEdge h, HalfEdge mate) {
        mates_[h] = mate;
        if (mate != kBoundary)
            mates_[mate] = h;
    }

    // `first`: the first side of the triangle.
    void split_if_sparse(HalfEdge first) {
        const std::array corners{from_[first], from_[first + 1], from_[first + 2]};
        glm::dvec3 centre(0);
        double spacing = 0;
        for (const std::uint32_t corner : corners) {
            centre += positions_[corner] / 3.0;
            spacing += spacing_[corner] / 3;
        }
        for (const std::uint32_t corner : corners)
            if (!(std::sqrt(2.0) * glm::distance(centre, positions_[corner]) > std::max(spacing, spacing_[corner])))
                return;
        const auto vertex = static_cast<std::uint32_t>(positions_.size());
        positions_.push_back(centre);
        spacing_.push_back(spacing);
        const auto second = static_cast<HalfEdge>(from_.size()), third = second + 3;
        const HalfEdge mate1 = mates_[first + 1], mate2 = mates_[first + 2];
        from_[first + 2] = vertex;
        from_.insert(from_.end(), {corners[1], corners[2], vertex, corners[2], corners[0], vertex});
        mates_.resize(from_.size());
        join(second, mate1);
        join(third, mate2);
        join(first + 1, second + 2);
        join(second + 1, third + 2);
        join(third + 1, first + 2);
        for (const HalfEdge side : {first, second, third})
            relax(side);
    }

    bool relax_all() {
        bool swapped = false;
        for (HalfEdge h = 0; h < mates_.size(); ++h)
            if (mates_[h] != kBoundary && h < mates_[h])
                swapped = relax(h) || swapped;
        return swapped;
    }

    // Swaps the edge if the angles that face it have a sum of more than pi, unless that would fold the faces or make an
    // edge that is there.
    bool relax(HalfEdge h) {
        const HalfEdge mate = mates_[h];
        if (mate == kBoundary)
            return false;
        const std::uint32_t left = from_[previous_side(h)], right = from_[previous_side(mate)];
        const glm::dvec3 &a = positions_[from_[h]], &b = positions_[to(h)], &c = positions_[left],
                         &d = positions_[right];
        const auto cotangent = [&](const glm::dvec3 &apex) {
            return glm::dot(a - apex, b - apex) / glm::length(glm::cross(a - apex, b - apex));
        };
        constexpr double kClear = 1e-9;
        if (!(cotangent(c) + cotangent(d) < -kClear))
            return false;
        const glm::dvec3 normal = glm::cross(b - a, c - a) + glm::cross(d - a, b - a);
        if (!(glm::dot(glm::cross(a - c, d - c), normal) > 0 && glm::dot(glm::cross(b - d, c - d), normal) > 0))
            return false;
        if (is_chord(left, right) || has_edge(previous_side(h), right))
            return false;
        swap_edge(h, mate);
        return true;
    }

    bool is_chord(std::uint32_t a, std::uint32_t b) const {
        return std::binary_search(rim_.chords.begin(), rim_.chords.end(), std::array{std::min(a, b), std::max(a, b)});
    }

    // Whether the vertex where `side` begins has an edge to `other`.
    bool has_edge(HalfEdge side, std::uint32_t other) const {
        HalfEdge h = side;
        do {
            if (to(h) == other || from_[previous_side(h)] == other)
                return true;
            h = mates_[previous_side(h)];
        } while (h != side && h != kBoundary);
        if (h == side)
            return false;
        for (h = mates_[side]; h != kBoundary; h = mates_[h]) {
            h = next_side(h);
            if (to(h) == other)
                return true;
        }
        return false;
    }

    // The faces a-b-c and b-a-d become a-d-c and b-c-d.
    void swap_edge(HalfEdge h, HalfEdge mate) {
        const HalfEdge bc = next_side(h), ad = next_side(mate);
        const HalfEdge beyond_bc = mates_[bc], beyond_ad = mates_[ad];
        const std::uint32_t c = from_[previous_side(h)];
        from_[bc] = from_[previous_side(mate)];
        from_[ad] = c;
        join(bc, ad);
        join(h, beyond_ad);
        join(mate, beyond_bc);
    }

    const Rim &rim_;
    std::vector<glm::dvec3> positions_;
    std::vector<double> spacing_;     // [positions]
    std::vector<std::uint32_t> from_; // [3 * triangles]
    std::vector<HalfEdge> mates_;     // [3 * triangles]
};

} // namespace

Patch refine_patch(const Rim &rim, const std::vector<PatchTriangle> &triangles) {
    Refinement refinement(rim, triangles);
    refinement.run();
    return refinement.patch();
}

} // namespace pbm::build
