#include "isosurface.h"

#include "system/threads/parallel.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <utility>

namespace pbm::sample {

namespace {

constexpr int kBlock = 4;      // cells along a block; 4^3 = 64 lattice points, one bit each
constexpr int kRegion = 8;     // blocks along a root region of the search; a power of two
constexpr double kReach = 0.5; // cells around a block that must also be free of surface to skip the block
constexpr std::int32_t kOutside = -1;
constexpr std::int32_t kInside = -2;

struct Cell {
    int x = 0;
    int y = 0;
    int z = 0;
};

// 4x4x4 lattice points (the low corners of the block's cells); bit and array order x + 4 y + 16 z.
struct Block {
    int x = 0;
    int y = 0;
    int z = 0;
    std::uint64_t inside = 0;       // lattice points with value < 0
    std::uint64_t crossed = 0;      // cells with a vertex
    std::uint32_t first_vertex = 0; // of the vertices, in bit order
    std::size_t first_triangle = 0;
    std::array<float, 64> value{};
};

// Converts a coordinate to an array index.
constexpr std::size_t slot(int coordinate) { return static_cast<std::size_t>(coordinate); }

// Signs of the lattice points of a block and of one layer beyond its high sides; [z][y][x].
using SignCube = std::array<std::array<std::array<bool, 5>, 5>, 5>;

class Lattice {
  public:
    Lattice(const DistanceField &field, const Box &box, double cell, int threads)
        : field_(field), origin_(box.low), cell_(cell), threads_(threads) {
        const Vec3 size = box.high - box.low;
        const auto regions = [cell](double edge) {
            return static_cast<int>(floor_to_int(edge / (cell * kBlock * kRegion))) + 1;
        };
        nx_ = regions(size.x) * kRegion;
        ny_ = regions(size.y) * kRegion;
        nz_ = regions(size.z) * kRegion;
    }

    void find_blocks();
    void evaluate_and_close();
    Isosurface mesh();

  private:
    Vec3 point(int x, int y, int z) const { return origin_ + Vec3{cell_ * x, cell_ * y, cell_ * z}; }

    std::int32_t &state(int bx, int by, int bz) {
        return state_[(static_cast<std::size_t>(bz) * static_cast<std::size_t>(ny_) + static_cast<std::size_t>(by)) *
                          static_cast<std::size_t>(nx_) +
                      static_cast<std::size_t>(bx)];
    }
    std::int32_t state_or_outside(int bx, int by, int bz) {
        if (bx < 0 || by < 0 || bz < 0 || bx >= nx_ || by >= ny_ || bz >= nz_)
            return kOutside;
        return state(bx, by, bz);
    }

    // Whether a cube of blocks has lattice points on the faces of the lattice, which count as outside.
    bool on_border(int bx, int by, int bz, int size) const {
        return bx == 0 || by == 0 || bz == 0 || bx + size == nx_ || by + size == ny_ || bz + size == nz_;
    }

    bool point_on_border(int x, int y, int z) const {
        return x == 0 || y == 0 || z == 0 || x + 1 == nx_ * kBlock || y + 1 == ny_ * kBlock || z + 1 == nz_ * kBlock;
    }

    static int bit(int x, int y, int z) { return (x & 3) | (y & 3) << 2 | (z & 3) << 4; }

    void classify(int bx, int by, int bz, int size);
    bool is_inside(int x, int y, int z);
    double value(int x, int y, int z);
    SignCube signs(const Block &block);
    std::uint32_t vertex_of(const Cell &c);
    void evaluate_block(Block &block);
    void evaluate(std::size_t first_block);
    void add_block(int bx, int by, int bz);
    bool grow(std::size_t index);
    bool is_uniform(const Block &block);
    bool fill_ambiguities(std::size_t index);
    bool fill(int x, int y, int z);
    static std::uint64_t crossed_cells(const SignCube &cube);
    template <typename Emit> void for_each_quad(const Block &block, const Emit &emit);
    void place_vertices(const Block &block, Isosurface &out);
    void place_triangles(const Block &block, Isosurface &out);

    const DistanceField &field_;
    Vec3 origin_;
    double cell_;
    int threads_;
    int nx_ = 0; // blocks
    int ny_ = 0;
    int nz_ = 0;
    std::vector<std::int32_t> state_; // index into blocks_, or kOutside, kInside; [nz][ny][nx]
    std::vector<Block> blocks_;       // z, y, x ascending
};

// Marks a cube of `size` blocks as empty, full, or to be evaluated (0).
void Lattice::classify(int bx, int by, int bz, int size) {
    const double half = 0.5 * kBlock * size;
    const double reach = (half + kReach) * 1.7320508075688772 * cell_;
    const Vec3 centre =
        origin_ + Vec3{(bx * kBlock + half) * cell_, (by * kBlock + half) * cell_, (bz * kBlock + half) * cell_};
    const double distance = field_(centre);
    const bool empty = distance > reach;
    const bool full = distance < -reach && !on_border(bx, by, bz, size);
    if (empty || full || size == 1) {
        const std::int32_t mark = empty ? kOutside : full ? kInside : 0;
        for (int z = bz; z < bz + size; ++z)
            for (int y = by; y < by + size; ++y)
                for (int x = bx; x < bx + size; ++x)
                    state(x, y, z) = mark;
        return;
    }
    const int step = size / 2; // the depth is log2(kRegion)
    for (int child = 0; child < 8; ++child)
        classify(bx + (child & 1) * step, by + (child >> 1 & 1) * step, bz + (child >> 2) * step, step);
}

void Lattice::find_blocks() {
    state_.resize(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz_));
    const int rx = nx_ / kRegion;
    const int ry = ny_ / kRegion;
    const int rz = nz_ / kRegion;
    const auto regions = static_cast<std::size_t>(rx) * static_cast<std::size_t>(ry) * static_cast<std::size_t>(rz);
    parallel_for(regions, 4, threads_, [&](std::size_t i) {
        const int r = static_cast<int>(i);
        classify(r % rx * kRegion, r / rx % ry * kRegion, r / (rx * ry) * kRegion, kRegion);
    });
    for (int z = 0; z < nz_; ++z)
        for (int y = 0; y < ny_; ++y)
            for (int x = 0; x < nx_; ++x)
                if (state(x, y, z) == 0)
                    add_block(x, y, z);
}

void Lattice::add_block(int bx, int by, int bz) {
    state(bx, by, bz) = static_cast<std::int32_t>(blocks_.size());
    blocks_.push_back(Block{.x = bx, .y = by, .z = bz});
}

// Evaluates lattice points. Points that a neighbour's distance proves to be far from the surface get a sign only.
void Lattice::evaluate_block(Block &block) {
    std::uint64_t known = 0;
    for (int step = 0; step < 64; ++step) {
        const int b = (step * 21 + 21) & 63; // scattered, so that the first few points decide most of a far block
        if ((known >> b & 1) != 0)
            continue;
        const int x = b & 3;
        const int y = b >> 2 & 3;
        const int z = b >> 4;
        const double d = field_(point(block.x * kBlock + x, block.y * kBlock + y, block.z * kBlock + z));
        block.value[static_cast<std::size_t>(b)] = static_cast<float>(d);
        known |= 1ull << b;
        const double free_cells = std::abs(d) / cell_ - 2.0;
        if (free_cells < 1.0)
            continue;
        for (int other = 0; other < 64; ++other) {
            const int dx = (other & 3) - x;
            const int dy = (other >> 2 & 3) - y;
            const int dz = (other >> 4) - z;
            const double squared = dx * dx + dy * dy + dz * dz;
            if ((known >> other & 1) != 0 || squared > free_cells * free_cells)
                continue;
            block.value[static_cast<std::size_t>(other)] = static_cast<float>(d > 0 ? cell_ : -cell_);
            known |= 1ull << other;
        }
    }
    if (on_border(block.x, block.y, block.z, 1))
        for (int b = 0; b < 64; ++b) {
            const int x = block.x * kBlock + (b & 3);
            const int y = block.y * kBlock + (b >> 2 & 3);
            const int z = block.z * kBlock + (b >> 4);
            if (point_on_border(x, y, z))
                block.value[static_cast<std::size_t>(b)] = static_cast<float>(cell_);
        }
    for (int b = 0; b < 64; ++b)
        block.inside |= static_cast<std::uint64_t>(block.value[static_cast<std::size_t>(b)] < 0) << b;
}

void Lattice::evaluate(std::size_t first_block) {
    parallel_for(blocks_.size() - first_block, 64, threads_,
                 [&](std::size_t i) { evaluate_block(blocks_[first_block + i]); });
}

bool Lattice::is_inside(int x, int y, int z) {
    const std::int32_t s = state_or_outside(x >> 2, y >> 2, z >> 2);
    if (s < 0)
        return s == kInside;
    return (blocks_[static_cast<std::size_t>(s)].inside >> bit(x, y, z) & 1) != 0;
}

double Lattice::value(int x, int y, int z) {
    const std::int32_t s = state_or_outside(x >> 2, y >> 2, z >> 2);
    if (s < 0)
        return s == kInside ? -cell_ : cell_;
    return static_cast<double>(blocks_[static_cast<std::size_t>(s)].value[static_cast<std::size_t>(bit(x, y, z))]);
}

SignCube Lattice::signs(const Block &block) {
    SignCube cube{};
    for (int dz = 0; dz < 2; ++dz)
        for (int dy = 0; dy < 2; ++dy)
            for (int dx = 0; dx < 2; ++dx) {
                const std::int32_t s = state_or_outside(block.x + dx, block.y + dy, block.z + dz);
                const std::uint64_t mask = s >= 0         ? blocks_[static_cast<std::size_t>(s)].inside
                                           : s == kInside ? ~0ull
                                                          : 0;
                for (int z = 0; z < (dz ? 1 : 4); ++z)
                    for (int y = 0; y < (dy ? 1 : 4); ++y)
                        for (int x = 0; x < (dx ? 1 : 4); ++x)
                            cube[slot(z + 4 * dz)][slot(y + 4 * dy)][slot(x + 4 * dx)] =
                                (mask >> bit(x, y, z) & 1) != 0;
            }
    return cube;
}

// Moves a lattice point just inside. Returns false if it was inside or must stay outside.
bool Lattice::fill(int x, int y, int z) {
    const std::int32_t s = state_or_outside(x >> 2, y >> 2, z >> 2);
    if (s < 0 || point_on_border(x, y, z) || is_inside(x, y, z))
        return false;
    Block &block = blocks_[static_cast<std::size_t>(s)];
    block.inside |= 1ull << bit(x, y, z);
    block.value[static_cast<std::size_t>(bit(x, y, z))] = static_cast<float>(-0.02 * cell_);
    return true;
}

// Adds the neighbours into which the surface of this block continues: blocks that were skipped as inside or outside but
// touch a lattice point of the other kind. Returns whether there were any.
bool Lattice::grow(std::size_t index) {
    const Block block = blocks_[index];
    bool grown = false;
    for (int n = 0; n < 27; ++n) {
        const Cell step{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        const std::int32_t s = state_or_outside(block.x + step.x, block.y + step.y, block.z + step.z);
        if (s >= 0)
            continue;
        constexpr std::uint64_t kXSide[3] = {0x1111111111111111ull, ~0ull, 0x8888888888888888ull};
        constexpr std::uint64_t kYSide[3] = {0x000f000f000f000full, ~0ull, 0xf000f000f000f000ull};
        constexpr std::uint64_t kZSide[3] = {0x000000000000ffffull, ~0ull, 0xffff000000000000ull};
        const std::uint64_t touching = kXSide[step.x + 1] & kYSide[step.y + 1] & kZSide[step.z + 1];
        const std::uint64_t other_kind = s == kInside ? ~block.inside : block.inside;
        if ((touching & other_kind) == 0)
            continue;
        add_block(block.x + step.x, block.y + step.y, block.z + step.z);
        grown = true;
    }
    return grown;
}

// Whether all lattice points of the block's cells lie on one side.
bool Lattice::is_uniform(const Block &block) {
    const std::uint64_t all = (block.inside & 1) != 0 ? ~0ull : 0;
    for (int n = 0; n < 8; ++n) {
        const std::int32_t s = state_or_outside(block.x + (n & 1), block.y + (n >> 1 & 1), block.z + (n >> 2));
        const std::uint64_t mask = s >= 0 ? blocks_[static_cast<std::size_t>(s)].inside : s == kInside ? ~0ull : 0;
        if (mask != all)
            return false;
    }
    return true;
}

// Fills faces with alternating signs, and cells with just two opposite corners inside or outside: there, two sheets of
// the surface would share an edge or a vertex. Filling only adds to the inside, so repeating it terminates.
bool Lattice::fill_ambiguities(std::size_t index) {
    if (is_uniform(blocks_[index]))
        return false;
    const Block block = blocks_[index];
    const SignCube cube = signs(block);
    bool changed = false;
    for (int b = 0; b < 64; ++b) {
        const int lx = b & 3;
        const int ly = b >> 2 & 3;
        const int lz = b >> 4;
        unsigned corners = 0;
        for (int c = 0; c < 8; ++c)
            corners |= static_cast<unsigned>(cube[slot(lz + (c >> 2))][slot(ly + (c >> 1 & 1))][slot(lx + (c & 1))])
                       << c;
        if (corners == 0 || corners == 0xffu)
            continue;
        const auto fill_corner = [&](int c) {
            changed |= fill(block.x * kBlock + lx + (c & 1), block.y * kBlock + ly + (c >> 1 & 1),
                            block.z * kBlock + lz + (c >> 2));
        };
        // The faces through corner 0; the opposite ones belong to the neighbours.
        for (const auto &[u, v] : {std::pair{1, 2}, std::pair{2, 4}, std::pair{4, 1}}) {
            const unsigned signs_of_face =
                (corners & 1u) | (corners >> u & 1u) << 1 | (corners >> v & 1u) << 2 | (corners >> (u + v) & 1u) << 3;
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

// Follows the surface into blocks that the search skipped because the field is no exact distance. Afterwards all cells
// with a sign change lie in stored blocks, so the surface is closed for any field.
void Lattice::evaluate_and_close() {
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

std::uint64_t Lattice::crossed_cells(const SignCube &cube) {
    std::uint64_t crossed = 0;
    for (std::size_t z = 0; z < 4; ++z)
        for (std::size_t y = 0; y < 4; ++y)
            for (std::size_t x = 0; x < 4; ++x) {
                int inside = 0;
                for (std::size_t c = 0; c < 8; ++c)
                    inside += cube[z + (c >> 2)][y + (c >> 1 & 1)][x + (c & 1)] ? 1 : 0;
                crossed |= static_cast<std::uint64_t>(inside != 0 && inside != 8) << (x + 4 * y + 16 * z);
            }
    return crossed;
}

std::uint32_t Lattice::vertex_of(const Cell &c) {
    const std::int32_t s = state(c.x >> 2, c.y >> 2, c.z >> 2);
    assert(s >= 0);
    const Block &block = blocks_[static_cast<std::size_t>(s)];
    const std::uint64_t below = (1ull << bit(c.x, c.y, c.z)) - 1;
    return block.first_vertex + static_cast<std::uint32_t>(std::popcount(block.crossed & below));
}

// Vertex: mean of the crossings on the cell's edges. Normal: from the differences along the edges.
void Lattice::place_vertices(const Block &block, Isosurface &out) {
    std::uint32_t vertex = block.first_vertex;
    for (std::uint64_t rest = block.crossed; rest != 0; rest &= rest - 1, ++vertex) {
        const int b = std::countr_zero(rest);
        const int x = block.x * kBlock + (b & 3);
        const int y = block.y * kBlock + (b >> 2 & 3);
        const int z = block.z * kBlock + (b >> 4);
        std::array<double, 8> v{};
        for (int c = 0; c < 8; ++c)
            v[static_cast<std::size_t>(c)] = value(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
        Vec3 sum;
        Vec3 gradient;
        int crossings = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (int c = 0; c < 8; ++c) {
                const int far_corner = c | 1 << axis;
                if (far_corner == c)
                    continue;
                const double va = v[static_cast<std::size_t>(c)];
                const double vb = v[static_cast<std::size_t>(far_corner)];
                (axis == 0 ? gradient.x : axis == 1 ? gradient.y : gradient.z) += vb - va;
                if ((va < 0) == (vb < 0))
                    continue;
                const double t = va / (va - vb);
                sum = sum + Vec3{axis == 0 ? t : (c & 1), axis == 1 ? t : (c >> 1 & 1), axis == 2 ? t : (c >> 2)};
                ++crossings;
            }
        const Vec3 p = point(x, y, z) + sum * (cell_ / crossings);
        const Vec3 n = normalized(gradient);
        out.position[vertex] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
        out.normal[vertex] = {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
    }
}

// Calls emit(a, b, c, d) with the four cells around each crossed lattice edge that starts in the block,
// counter-clockwise seen from outside.
template <typename Emit> void Lattice::for_each_quad(const Block &block, const Emit &emit) {
    const SignCube cube = signs(block);
    for (int b = 0; b < 64; ++b) {
        const int lx = b & 3;
        const int ly = b >> 2 & 3;
        const int lz = b >> 4;
        const int x = block.x * kBlock + lx;
        const int y = block.y * kBlock + ly;
        const int z = block.z * kBlock + lz;
        const bool here =
            cube[static_cast<std::size_t>(lz)][static_cast<std::size_t>(ly)][static_cast<std::size_t>(lx)];
        for (int axis = 0; axis < 3; ++axis) {
            const bool there = cube[slot(lz + (axis == 2))][slot(ly + (axis == 1))][slot(lx + (axis == 0))];
            if (here == there)
                continue;
            // u, v: the two axes after `axis`, cyclically; u x v points along `axis`.
            const Cell u{axis == 2, axis == 0, axis == 1};
            const Cell v{axis == 1, axis == 2, axis == 0};
            const Cell q0{x - u.x - v.x, y - u.y - v.y, z - u.z - v.z};
            const Cell q1{x - v.x, y - v.y, z - v.z};
            const Cell q2{x, y, z};
            const Cell q3{x - u.x, y - u.y, z - u.z};
            if (here)
                emit(q0, q1, q2, q3);
            else
                emit(q3, q2, q1, q0);
        }
    }
}

void Lattice::place_triangles(const Block &block, Isosurface &out) {
    std::size_t at = block.first_triangle;
    const auto squared_distance = [&out](std::uint32_t a, std::uint32_t b) {
        const auto &p = out.position[a];
        const auto &q = out.position[b];
        const double dx = static_cast<double>(p[0]) - static_cast<double>(q[0]);
        const double dy = static_cast<double>(p[1]) - static_cast<double>(q[1]);
        const double dz = static_cast<double>(p[2]) - static_cast<double>(q[2]);
        return dx * dx + dy * dy + dz * dz;
    };
    for_each_quad(block, [&](const Cell &q0, const Cell &q1, const Cell &q2, const Cell &q3) {
        const std::uint32_t a = vertex_of(q0);
        const std::uint32_t b = vertex_of(q1);
        const std::uint32_t c = vertex_of(q2);
        const std::uint32_t d = vertex_of(q3);
        const bool split_ac = squared_distance(a, c) <= squared_distance(b, d);
        out.triangle[at++] = split_ac ? std::array{a, b, c} : std::array{a, b, d};
        out.triangle[at++] = split_ac ? std::array{a, c, d} : std::array{b, c, d};
    });
}

Isosurface Lattice::mesh() {
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
        const std::size_t count = block.first_triangle;
        block.first_triangle = triangles;
        triangles += count;
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

} // namespace

Isosurface extract_isosurface(const DistanceField &field, const Box &box, double cell, int threads) {
    Lattice lattice(field, box, cell, threads);
    lattice.find_blocks();
    lattice.evaluate_and_close();
    return lattice.mesh();
}

} // namespace pbm::sample
