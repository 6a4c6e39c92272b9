#include "pbm_build/winding/edge_joins.h"

#include "pbm_build/lattice/radix_sort.h"
#include "system/threads/cancellation.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <numeric>
#include <span>
#include <utility>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 32768;  // vertices, or faces
constexpr std::size_t kMaxInCell = 64; // corners that are compared with others: a cell of many has no seam

struct Side {
    std::uint32_t end; // the higher vertex of the edge
    HalfEdge side;
    bool rises; // from the lower vertex to the higher one
};

// The sides of some faces, grouped by their lower vertex. `vertex_of` replaces the numbers of vertices; empty: it does
// not.
class SidesOfVertices {
  public:
    // Of all faces.
    explicit SidesOfVertices(const Surface &surface) : surface_(surface) {
        collect([&](const auto &use) {
            for (std::uint32_t i = 0; i < surface.triangles.size(); ++i) {
                if (i % kBlock == 0)
                    check_cancelled();
                const glm::uvec3 &t = surface.triangles[i];
                use(std::min(t.x, t.y), 3 * i);
                use(std::min(t.y, t.z), 3 * i + 1);
                use(std::min(t.z, t.x), 3 * i + 2);
            }
        });
    }
    // Of some sides, but for those without a length and those of faces without an area.
    SidesOfVertices(const Surface &surface, std::span<const HalfEdge> sides, std::span<const std::uint32_t> vertex_of)
        : surface_(surface), vertex_of_(vertex_of) {
        collect([&](const auto &use) {
            for (const HalfEdge h : sides) {
                const std::uint32_t a = corner(h), b = corner(next_side(h)), c = corner(previous_side(h));
                if (a != b && b != c && c != a)
                    use(std::min(a, b), h);
            }
        });
    }

    std::size_t vertices() const { return starts_.size() - 1; }

    // Fills `sides` with those whose lower vertex is `vertex`, edge by edge.
    void get(std::size_t vertex, std::vector<Side> &sides) const {
        sides.clear();
        for (std::uint32_t at = starts_[vertex]; at < starts_[vertex + 1]; ++at) {
            const HalfEdge h = sides_[at];
            const std::uint32_t from = corner(h), to = corner(next_side(h));
            sides.push_back({std::max(from, to), h, from < to});
        }
        std::sort(sides.begin(), sides.end(),
                  [](const Side &a, const Side &b) { return a.end != b.end ? a.end < b.end : a.side < b.side; });
    }
    std::uint32_t corner(HalfEdge h) const {
        const std::uint32_t vertex = surface_.triangles[h / 3][static_cast<int>(h % 3)];
        return vertex_of_.empty() ? vertex : vertex_of_[vertex];
    }

  private:
    template <class Visit> void collect(const Visit &visit) {
        starts_.assign(surface_.positions.size() + 1, 0);
        visit([&](std::uint32_t vertex, HalfEdge) { ++starts_[vertex]; });
        std::uint32_t sum = 0;
        for (std::uint32_t &start : starts_)
            start = sum += start;
        sides_.resize(sum);
        visit([&](std::uint32_t vertex, HalfEdge h) { sides_[--starts_[vertex]] = h; });
    }

    const Surface &surface_;
    std::span<const std::uint32_t> vertex_of_;
    std::vector<std::uint32_t> starts_; // [vertices + 1]
    std::vector<HalfEdge> sides_;
};

// What the edges of some vertices add to the result.
struct FoundEdges {
    std::vector<std::array<HalfEdge, 2>> against;
    std::vector<HalfEdge> open, complex;
    std::vector<std::size_t> complex_ends;

    void add(std::span<const Side> edge, const SidesOfVertices &all, SharedSets &faces) {
        if (edge.size() == 1) {
            open.push_back(edge[0].side);
            return;
        }
        const HalfEdge a = edge[0].side, b = edge[1].side;
        if (edge.size() == 2 && edge[0].rises != edge[1].rises)
            faces.join(a / 3, b / 3);
        else if (edge.size() == 2 && all.corner(previous_side(a)) != all.corner(previous_side(b)))
            against.push_back({a, b});
        else {
            for (const Side &side : edge)
                complex.push_back(side.side);
            complex_ends.push_back(complex.size());
        }
    }
    void append_to(EdgeJoins &joins) const {
        joins.against.insert(joins.against.end(), against.begin(), against.end());
        joins.open.insert(joins.open.end(), open.begin(), open.end());
        for (const std::size_t end : complex_ends)
            joins.complex_ends.push_back(joins.complex.size() + end);
        joins.complex.insert(joins.complex.end(), complex.begin(), complex.end());
    }
};

void find_edges(const SidesOfVertices &sides, SharedSets &faces, EdgeJoins &joins, int threads) {
    std::vector<FoundEdges> found((sides.vertices() + kBlock - 1) / kBlock);
    parallel_blocks(sides.vertices(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
        FoundEdges &here = found[begin / kBlock];
        std::vector<Side> around;
        for (std::size_t vertex = begin; vertex < end; ++vertex) {
            sides.get(vertex, around);
            for (std::size_t first = 0, after = 0; first < around.size(); first = after) {
                while (after < around.size() && around[after].end == around[first].end)
                    ++after;
                here.add(std::span(around).subspan(first, after - first), sides, faces);
            }
        }
    });
    for (const FoundEdges &here : found)
        here.append_to(joins);
}

std::uint32_t hash_of(const glm::dvec3 &p) {
    std::uint64_t hash = 0;
    for (const double x : {p.x + 0.0, p.y + 0.0, p.z + 0.0}) { // -0 and 0 are equal
        hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x9E3779B97F4A7C15U;
        hash ^= hash >> 29;
    }
    return static_cast<std::uint32_t>(hash >> 32);
}

// How much two positions may differ that are one vertex.
struct Nearness {
    double distance = 0; // along each axis
    double cell = 0;     // edge of the cells that find them; 0: equal positions only
    double shift = 0;    // of the cells, as a share of them

    glm::dvec3 place(const glm::dvec3 &p) const { return cell > 0 ? glm::floor(p / cell + shift) : p; }
    bool joins(const glm::dvec3 &p, const glm::dvec3 &q) const {
        const glm::dvec3 d = glm::abs(p - q);
        return std::max({d.x, d.y, d.z}) <= distance;
    }
};

// Welds the corners of `sides`: `vertex_of` gets the lowest vertex that is near. Returns whether there was one.
bool weld_corners(const Surface &surface, std::span<const HalfEdge> sides, const Nearness &near,
                  std::vector<std::uint32_t> &vertex_of) {
    check_cancelled();
    std::vector<bool> wanted(surface.positions.size());
    for (const HalfEdge h : sides)
        for (const HalfEdge corner : {h, next_side(h)})
            wanted[vertex_of[surface.triangles[corner / 3][static_cast<int>(corner % 3)]]] = true;
    std::vector<std::uint64_t> words, spare;
    for (std::size_t i = 0; i < wanted.size(); ++i)
        if (wanted[i])
            words.push_back(std::uint64_t{hash_of(near.place(surface.positions[i]))} << 32 | i);
    radix_sort(words, spare, 32, 32);
    bool any = false;
    for (std::size_t first = 0, after = 0; first < words.size(); first = after)
        for (; after < words.size() && words[after] >> 32 == words[first] >> 32; ++after) {
            const auto vertex = static_cast<std::uint32_t>(words[after]);
            for (std::size_t earlier = first; earlier < std::min(after, first + kMaxInCell);
                 ++earlier) { // radix_sort is stable
                const auto other = static_cast<std::uint32_t>(words[earlier]);
                if (vertex_of[other] != other || !near.joins(surface.positions[other], surface.positions[vertex]))
                    continue;
                vertex_of[vertex] = other;
                any = true;
                break;
            }
        }
    for (std::size_t i = 0; any && i < vertex_of.size(); ++i) // lower vertices are final
        vertex_of[i] = vertex_of[vertex_of[i]];
    return any;
}

// The longest edge of the box around the corners of `sides`.
double extent_of(const Surface &surface, std::span<const HalfEdge> sides) {
    const auto start = [&](HalfEdge h) { return surface.positions[surface.triangles[h / 3][static_cast<int>(h % 3)]]; };
    glm::dvec3 lowest = start(sides.front()), highest = lowest;
    for (const HalfEdge h : sides) {
        lowest = glm::min(lowest, start(h));
        highest = glm::max(highest, start(h));
    }
    const glm::dvec3 size = highest - lowest;
    return std::max({size.x, size.y, size.z});
}

// Joins open edges whose ends are at equal positions, then those that differ by the rounding of single precision. Two
// grids of cells find near positions: those at a border of one lie within a cell of the other.
void close_seams(const Surface &surface, SharedSets &faces, EdgeJoins &joins, int threads) {
    if (joins.open.empty())
        return;
    const double distance = 0x1p-21 * extent_of(surface, joins.open), cell = 64 * distance;
    std::vector<std::uint32_t> vertex_of(surface.positions.size());
    std::iota(vertex_of.begin(), vertex_of.end(), 0U);
    for (const std::vector<Nearness> &step :
         {std::vector<Nearness>{{}}, std::vector<Nearness>{{distance, cell, 0.25}, {distance, cell, 0.75}}}) {
        bool any = false;
        for (const Nearness &near : step)
            any |= weld_corners(surface, joins.open, near, vertex_of);
        if (!any)
            continue;
        const std::vector<HalfEdge> open = std::exchange(joins.open, {});
        find_edges(SidesOfVertices(surface, open, vertex_of), faces, joins, threads);
    }
}

} // namespace

SharedSets::SharedSets(std::size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0U); }

// Parents are lower than their children and only become lower, so that a value that another thread has replaced still
// leads to the root.
std::uint32_t SharedSets::find(std::uint32_t i) {
    const auto parent = [&](std::uint32_t of) { return std::atomic_ref(parents_[of]).load(std::memory_order_relaxed); };
    for (std::uint32_t up = parent(i); up != i;) {
        const std::uint32_t above = parent(up);
        if (above != up)
            std::atomic_ref(parents_[i]).store(above, std::memory_order_relaxed);
        i = up;
        up = above;
    }
    return i;
}

void SharedSets::join(std::uint32_t a, std::uint32_t b) {
    for (;;) {
        a = find(a);
        b = find(b);
        if (a == b)
            return;
        if (a > b)
            std::swap(a, b);
        std::uint32_t expected = b;
        if (std::atomic_ref(parents_[b]).compare_exchange_weak(expected, a, std::memory_order_relaxed))
            return;
    }
}

EdgeJoins join_edges(const Surface &surface, int threads) {
    EdgeJoins joins;
    SharedSets faces(surface.triangles.size());
    find_edges(SidesOfVertices(surface), faces, joins, threads);
    close_seams(surface, faces, joins, threads);
    joins.patches.resize(surface.triangles.size());
    for (std::uint32_t i = 0; i < joins.patches.size(); ++i) {
        if (i % kBlock == 0)
            check_cancelled();
        const std::uint32_t first = faces.find(i);
        joins.patches[i] = first == i ? joins.patch_count++ : joins.patches[first];
    }
    return joins;
}

} // namespace pbm::build
