#include "isosurface.h"

#include "system/threads/parallel.h"

#include <glm/vector_relational.hpp>

#include <algorithm>
#include <bit>
#include <cassert>
#include <numeric>
#include <utility>

namespace pbm::sample {

namespace {

using Cell = glm::ivec3;

constexpr int kBlock = 4;      // cells along a block; 4^3 = 64 lattice points, one bit each
constexpr int kRegion = 8;     // blocks along a root region of the search; a power of two
constexpr double kReach = 0.5; // cells around a block that must also be free of surface to skip the block
constexpr std::int32_t kOutside = -1;
constexpr std::int32_t kInside = -2;

// 4x4x4 lattice points (the low corners of the block's cells); bit and array order x + 4 y + 16 z.
struct Block {
    glm::ivec3 at;                  // in blocks
    std::uint64_t inside = 0;       // lattice points with value < 0
    std::uint64_t crossed = 0;      // cells with a vertex
    std::uint32_t first_vertex = 0; // of the vertices, in bit order
    std::size_t first_triangle = 0;
    std::array<float, 64> value{};
};

int bit_of(const Cell &p) { return (p.x & 3) | (p.y & 3) << 2 | (p.z & 3) << 4; }
Cell cell_of(int bit) { return {bit & 3, bit >> 2 & 3, bit >> 4}; } // within its block
glm::ivec3 corner(int number) { return {number & 1, number >> 1 & 1, number >> 2}; }

// Signs of the lattice points of a block and of one layer beyond its high sides; [z][y][x].
using SignCube = std::array<std::array<std::array<bool, 5>, 5>, 5>;
template <class Cube> auto &sign_at(Cube &cube, const Cell &p) {
    return cube[static_cast<std::size_t>(p.z)][static_cast<std::size_t>(p.y)][static_cast<std::size_t>(p.x)];
}

class Lattice {
  public:
    Lattice(const DistanceField &field, const Box &box, double cell, int threads)
        : field_(field), origin_(box.low), cell_(cell), threads_(threads) {
        const Vec3 size = box.high - box.low;
        for (int axis = 0; axis < 3; ++axis)
            size_[axis] = (static_cast<int>(floor_to_int(size[axis] / (cell * kBlock * kRegion))) + 1) * kRegion;
    }

    Isosurface extract() {
        find_blocks();
        evaluate_and_close();
        return mesh();
    }

  private:
    Vec3 point(const Cell &p) const { return origin_ + Vec3(p) * cell_; }

    std::int32_t &state(const glm::ivec3 &block) {
        const std::size_t x = static_cast<std::size_t>(block.x), y = static_cast<std::size_t>(block.y),
                          z = static_cast<std::size_t>(block.z);
        return state_[(z * static_cast<std::size_t>(size_.y) + y) * static_cast<std::size_t>(size_.x) + x];
    }
    std::int32_t state_or_outside(const glm::ivec3 &block) {
        const bool outside =
            glm::any(glm::lessThan(block, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(block, size_));
        return outside ? kOutside : state(block);
    }
    std::uint64_t inside_or_all(std::int32_t state) const {
        return state >= 0 ? blocks_[static_cast<std::size_t>(state)].inside : state == kInside ? ~0ull : 0;
    }

    // Whether a cube of blocks has lattice points on the faces of the lattice, which count as outside.
    bool on_border(const glm::ivec3 &block, int size) const {
        return glm::any(glm::equal(block, glm::ivec3(0))) || glm::any(glm::equal(block + size, size_));
    }
    bool point_on_border(const Cell &p) const {
        return glm::any(glm::equal(p, Cell(0))) || glm::any(glm::equal(p + 1, size_ * kBlock));
    }

    // Marks a cube of `size` blocks as empty, full, or to be evaluated (0).
    void classify(const glm::ivec3 &first, int size) {
        const double half = 0.5 * kBlock * size;
        const double reach = (half + kReach) * 1.7320508075688772 * cell_;
        const double distance = field_(origin_ + (Vec3(first * kBlock) + half) * cell_);
        const bool empty = distance > reach;
        const bool full = distance < -reach && !on_border(first, size);
        if (empty || full || size == 1) {
            const std::int32_t mark = empty ? kOutside : full ? kInside : 0;
            for (int z = 0; z < size; ++z)
                for (int y = 0; y < size; ++y)
                    for (int x = 0; x < size; ++x)
                        state(first + glm::ivec3(x, y, z)) = mark;
            return;
        }
        const int step = size / 2; // the depth is log2(kRegion)
        for (int child = 0; child < 8; ++child)
            classify(first + corner(child) * step, step);
    }

    void find_blocks() {
        const glm::ivec3 regions = size_ / kRegion;
        const auto count = [](const glm::ivec3 &v) {
            return static_cast<std::size_t>(v.x) * static_cast<std::size_t>(v.y) * static_cast<std::size_t>(v.z);
        };
        state_.resize(count(size_));
        parallel_for(count(regions), 4, threads_, [&](std::size_t i) {
            const int r = static_cast<int>(i);
            classify(
                {r % regions.x * kRegion, r / regions.x % regions.y * kRegion, r / (regions.x * regions.y) * kRegion},
                kRegion);
        });
        for (int z = 0; z < size_.z; ++z)
            for (int y = 0; y < size_.y; ++y)
                for (int x = 0; x < size_.x; ++x)
                    if (state({x, y, z}) == 0)
                        add_block({x, y, z});
    }

    void add_block(const glm::ivec3 &at) {
        state(at) = static_cast<std::int32_t>(blocks_.size());
        blocks_.push_back(Block{.at = at});
    }

    // Evaluates lattice points. Points that a neighbour's distance proves to be far from the surface get a sign only.
    void evaluate_block(Block &block) {
        const Cell first = block.at * kBlock;
        std::uint64_t known = 0;
        for (int step = 0; step < 64; ++step) {
            const int b = (step * 21 + 21) & 63; // scattered, so that the first few points decide most of a far block
            if ((known >> b & 1) != 0)
                continue;
            const double d = field_(point(first + cell_of(b)));
            block.value[static_cast<std::size_t>(b)] = static_cast<float>(d);
            known |= 1ull << b;
            const double free_cells = std::abs(d) / cell_ - 2.0;
            if (free_cells < 1.0)
                continue;
            for (int other = 0; other < 64; ++other) {
                const glm::ivec3 way = cell_of(other) - cell_of(b);
                const double squared = way.x * way.x + way.y * way.y + way.z * way.z;
                if ((known >> other & 1) != 0 || squared > free_cells * free_cells)
                    continue;
                block.value[static_cast<std::size_t>(other)] = static_cast<float>(d > 0 ? cell_ : -cell_);
                known |= 1ull << other;
            }
        }
        for (int b = 0; b < 64; ++b) {
            float &value = block.value[static_cast<std::size_t>(b)];
            if (point_on_border(first + cell_of(b)))
                value = static_cast<float>(cell_);
            block.inside |= static_cast<std::uint64_t>(value < 0) << b;
        }
    }

    void evaluate(std::size_t first_block) {
        parallel_for(blocks_.size() - first_block, 64, threads_,
                     [&](std::size_t i) { evaluate_block(blocks_[first_block + i]); });
    }

    double value(const Cell &p) {
        const std::int32_t s = state_or_outside(p >> 2);
        if (s < 0)
            return s == kInside ? -cell_ : cell_;
        return static_cast<double>(blocks_[static_cast<std::size_t>(s)].value[static_cast<std::size_t>(bit_of(p))]);
    }

    SignCube signs(const Block &block) {
        SignCube cube{};
        for (int n = 0; n < 8; ++n) {
            const glm::ivec3 step = corner(n), size = 4 - 3 * step;
            const std::uint64_t mask = inside_or_all(state_or_outside(block.at + step));
            for (int z = 0; z < size.z; ++z)
                for (int y = 0; y < size.y; ++y)
                    for (int x = 0; x < size.x; ++x)
                        sign_at(cube, Cell(x, y, z) + 4 * step) = (mask >> bit_of({x, y, z}) & 1) != 0;
        }
        return cube;
    }

    // Moves a lattice point just inside. Returns false if it was inside or must stay outside.
    bool fill(const Cell &p) {
        const std::int32_t s = state_or_outside(p >> 2);
        if (s < 0 || point_on_border(p))
            return false;
        Block &block = blocks_[static_cast<std::size_t>(s)];
        if ((block.inside >> bit_of(p) & 1) != 0)
            return false;
        block.inside |= 1ull << bit_of(p);
        block.value[static_cast<std::size_t>(bit_of(p))] = static_cast<float>(-0.02 * cell_);
        return true;
    }

    // Adds the neighbours into which the surface of this block continues: blocks that were skipped as inside or outside
    // but touch a lattice point of the other kind. Returns whether there were any.
    bool grow(std::size_t index) {
        const Block block = blocks_[index];
        bool grown = false;
        for (int n = 0; n < 27; ++n) {
            const glm::ivec3 step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
            const std::int32_t s = state_or_outside(block.at + step);
            if (s >= 0)
                continue;
            constexpr std::uint64_t kXSide[3] = {0x1111111111111111ull, ~0ull, 0x8888888888888888ull};
            constexpr std::uint64_t kYSide[3] = {0x000f000f000f000full, ~0ull, 0xf000f000f000f000ull};
            constexpr std::uint64_t kZSide[3] = {0x000000000000ffffull, ~0ull, 0xffff000000000000ull};
            const std::uint64_t touching = kXSide[step.x + 1] & kYSide[step.y + 1] & kZSide[step.z + 1];
            if ((touching & (block.inside ^ inside_or_all(s))) == 0)
                continue;
            add_block(block.at + step);
            grown = true;
        }
        return grown;
    }

    // Whether all lattice points of the block's cells lie on one side.
    bool is_uniform(const Block &block) {
        const std::uint64_t all = (block.inside & 1) != 0 ? ~0ull : 0;
        for (int n = 0; n < 8; ++n)
            if (inside_or_all(state_or_outside(block.at + corner(n))) != all)
                return false;
        return true;
    }

    // Bit c: whether corner c of a cell is inside.
    static unsigned corner_signs(const SignCube &cube, const Cell &cell) {
        unsigned corners = 0;
        for (int c = 0; c < 8; ++c)
            corners |= static_cast<unsigned>(sign_at(cube, cell + corner(c))) << c;
        return corners;
    }

    // Fills faces with alternating signs, and cells with just two opposite corners inside or outside: there, two sheets
    // of the surface would share an edge or a vertex. Filling only adds to the inside, so repeating it terminates.
    bool fill_ambiguities(std::size_t index) {
        if (is_uniform(blocks_[index]))
            return false;
        const Block block = blocks_[index];
        const SignCube cube = signs(block);
        bool changed = false;
        for (int b = 0; b < 64; ++b) {
            const unsigned corners = corner_signs(cube, cell_of(b));
            if (corners == 0 || corners == 0xffu)
                continue;
            const auto fill_corner = [&](int c) { changed |= fill(block.at * kBlock + cell_of(b) + corner(c)); };
            // The faces through corner 0; the opposite ones belong to the neighbours.
            for (const auto &[u, v] : {std::pair{1, 2}, std::pair{2, 4}, std::pair{4, 1}}) {
                const unsigned signs_of_face = (corners & 1u) | (corners >> u & 1u) << 1 | (corners >> v & 1u) << 2 |
                                               (corners >> (u + v) & 1u) << 3;
                if (signs_of_face == 0b1001u)
                    fill_corner(u);
                else if (signs_of_face == 0b0110u)
                    fill_corner(0);
            }
            for (int c = 0; c < 4; ++c) {
                const unsigned diagonal = 1u << c | 1u << (7 - c);
                if (corners == diagonal)
                    fill_corner(c ^ 1);
                else if (corners == (~diagonal & 0xffu))
                    fill_corner(c);
            }
        }
        return changed;
    }

    // Follows the surface into blocks that the search skipped because the field is no exact distance. Afterwards all
    // cells with a sign change lie in stored blocks, so the surface is closed for any field.
    void evaluate_and_close() {
        evaluate(0);
        for (bool changed = true; changed;) {
            changed = false;
            for (std::size_t first = 0; first < blocks_.size();) {
                const std::size_t end = blocks_.size();
                for (std::size_t i = 0; i < end; ++i)
                    changed |= grow(i);
                first = end;
                evaluate(first);
            }
            for (std::size_t i = 0; i < blocks_.size(); ++i)
                changed |= fill_ambiguities(i);
        }
    }

    static std::uint64_t crossed_cells(const SignCube &cube) {
        std::uint64_t crossed = 0;
        for (int b = 0; b < 64; ++b) {
            const unsigned corners = corner_signs(cube, cell_of(b));
            crossed |= static_cast<std::uint64_t>(corners != 0 && corners != 0xffu) << b;
        }
        return crossed;
    }

    std::uint32_t vertex_of(const Cell &c) {
        const std::int32_t s = state(c >> 2);
        assert(s >= 0);
        const Block &block = blocks_[static_cast<std::size_t>(s)];
        const std::uint64_t below = (1ull << bit_of(c)) - 1;
        return block.first_vertex + static_cast<std::uint32_t>(std::popcount(block.crossed & below));
    }

    // Vertex: mean of the crossings on the cell's edges. Normal: from the differences along the edges.
    void place_vertices(const Block &block, Isosurface &out) {
        std::uint32_t vertex = block.first_vertex;
        for (std::uint64_t rest = block.crossed; rest != 0; rest &= rest - 1, ++vertex) {
            const Cell cell = block.at * kBlock + cell_of(std::countr_zero(rest));
            std::array<double, 8> v{};
            for (int c = 0; c < 8; ++c)
                v[static_cast<std::size_t>(c)] = value(cell + corner(c));
            Vec3 sum(0.0), gradient(0.0);
            int crossings = 0;
            for (int axis = 0; axis < 3; ++axis)
                for (int c = 0; c < 8; ++c) {
                    const int far_corner = c | 1 << axis;
                    if (far_corner == c)
                        continue;
                    const double va = v[static_cast<std::size_t>(c)], vb = v[static_cast<std::size_t>(far_corner)];
                    gradient[axis] += vb - va;
                    if ((va < 0) == (vb < 0))
                        continue;
                    Vec3 crossing(corner(c));
                    crossing[axis] = va / (va - vb);
                    sum += crossing;
                    ++crossings;
                }
            out.position[vertex] = glm::vec3(point(cell) + sum * (cell_ / crossings));
            out.normal[vertex] = glm::vec3(normalized(gradient));
        }
    }

    // Calls emit(a, b, c, d) with the four cells around each crossed lattice edge that starts in the block,
    // counter-clockwise seen from outside.
    template <typename Emit> void for_each_quad(const Block &block, const Emit &emit) {
        const SignCube cube = signs(block);
        for (int b = 0; b < 64; ++b) {
            const Cell here = cell_of(b), cell = block.at * kBlock + here;
            for (int axis = 0; axis < 3; ++axis) {
                Cell along(0), u(0), v(0); // u, v: the two axes after `axis`; u x v points along `axis`
                along[axis] = u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
                const bool inside = sign_at(cube, here);
                if (inside == sign_at(cube, here + along))
                    continue;
                if (inside)
                    emit(cell - u - v, cell - v, cell, cell - u);
                else
                    emit(cell - u, cell, cell - v, cell - u - v);
            }
        }
    }

    void place_triangles(const Block &block, Isosurface &out) {
        std::size_t at = block.first_triangle;
        const auto squared_distance = [&out](std::uint32_t a, std::uint32_t b) {
            const Vec3 way = Vec3(out.position[a]) - Vec3(out.position[b]);
            return dot(way, way);
        };
        for_each_quad(block, [&](const Cell &q0, const Cell &q1, const Cell &q2, const Cell &q3) {
            const std::uint32_t a = vertex_of(q0), b = vertex_of(q1), c = vertex_of(q2), d = vertex_of(q3);
            const bool split_ac = squared_distance(a, c) <= squared_distance(b, d);
            out.triangle[at++] = split_ac ? std::array{a, b, c} : std::array{a, b, d};
            out.triangle[at++] = split_ac ? std::array{a, c, d} : std::array{b, c, d};
        });
    }

    Isosurface mesh() {
        parallel_for(blocks_.size(), 256, threads_, [&](std::size_t i) {
            if (is_uniform(blocks_[i]))
                return;
            blocks_[i].crossed = crossed_cells(signs(blocks_[i]));
            std::size_t quads = 0;
            for_each_quad(blocks_[i], [&quads](auto &&...) { ++quads; });
            blocks_[i].first_triangle = 2 * quads; // a count, until summed below
        });
        std::uint32_t vertices = 0;
        std::size_t triangles = 0;
        for (Block &block : blocks_) {
            block.first_vertex = vertices;
            vertices += static_cast<std::uint32_t>(std::popcount(block.crossed));
            triangles += std::exchange(block.first_triangle, triangles);
        }
        Isosurface out;
        out.position.resize(vertices);
        out.normal.resize(vertices);
        out.triangle.resize(triangles);
        parallel_for(blocks_.size(), 256, threads_, [&](std::size_t i) { place_vertices(blocks_[i], out); });
        parallel_for(blocks_.size(), 256, threads_, [&](std::size_t i) {
            if (blocks_[i].crossed != 0)
                place_triangles(blocks_[i], out);
        });
        return out;
    }

    const DistanceField &field_;
    Vec3 origin_;
    double cell_;
    int threads_;
    glm::ivec3 size_;                 // blocks
    std::vector<std::int32_t> state_; // index into blocks_, or kOutside, kInside; [z][y][x]
    std::vector<Block> blocks_;       // z, y, x ascending
};

} // namespace

Isosurface extract_isosurface(const DistanceField &field, const Box &box, double cell, int threads) {
    return Lattice(field, box, cell, threads).extract();
}

void keep_largest_piece(Isosurface &surface) {
    if (surface.position.empty())
        return;
    std::vector<std::uint32_t> parent(surface.position.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&parent](std::uint32_t v) {
        while (parent[v] != v)
            v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const auto &t : surface.triangle)
        for (const std::uint32_t v : {t[1], t[2]}) {
            const std::uint32_t a = root(t[0]);
            const std::uint32_t b = root(v);
            parent[std::max(a, b)] = std::min(a, b);
        }
    std::vector<std::uint32_t> size(parent.size());
    for (std::uint32_t v = 0; v < parent.size(); ++v)
        ++size[root(v)];
    const auto largest = static_cast<std::uint32_t>(std::max_element(size.begin(), size.end()) - size.begin());
    std::vector<std::uint32_t> renamed(parent.size());
    std::uint32_t kept = 0;
    for (std::uint32_t v = 0; v < parent.size(); ++v)
        if (root(v) == largest) {
            surface.position[kept] = surface.position[v];
            surface.normal[kept] = surface.normal[v];
            renamed[v] = kept++;
        }
    surface.position.resize(kept);
    surface.normal.resize(kept);
    std::erase_if(surface.triangle, [&](const auto &t) { return root(t[0]) != largest; });
    for (auto &t : surface.triangle)
        t = {renamed[t[0]], renamed[t[1]], renamed[t[2]]};
}

} // namespace pbm::sample
