#include "pbm_bake/shadow_rays.h"

#include "system/threads/parallel.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace pbm {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

constexpr std::size_t kFour = 4;
constexpr std::size_t kAtOnce = 4096;
// 32 layers suffice for any count of triangles; at each layer at most three siblings wait on the stack.
constexpr std::size_t kStack = 3 * 32 + 1;
constexpr float kNowhere = 1e18F; // its square is finite
constexpr Position kNoPlace{kNowhere, kNowhere, kNowhere};

Float4 least(Float4 a, Float4 b) { return a < b ? a : b; }
Float4 most(Float4 a, Float4 b) { return a > b ? a : b; }
float least(float a, float b, float c) { return std::min(a, std::min(b, c)); }
float most(float a, float b, float c) { return std::max(a, std::max(b, c)); }
Float4 all(float value) { return Float4{value, value, value, value}; }
bool any(Int4 mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

Position minus(const Position &a, const Position &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
float dot(const Position &a, const Position &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Position along(const Position &from, const Position &way, float length) {
    return {from[0] + length * way[0], from[1] + length * way[1], from[2] + length * way[2]};
}

Float4 dot(const std::array<Float4, 3> &a, const std::array<Float4, 3> &b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
std::array<Float4, 3> cross(const std::array<Float4, 3> &a, const std::array<Float4, 3> &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Centre {
    Position at;
    std::uint32_t triangle;
};

std::size_t longest_axis(std::span<const Centre> centres) {
    Position low = centres.front().at, high = low;
    for (const Centre &centre : centres)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], centre.at[axis]);
            high[axis] = std::max(high[axis], centre.at[axis]);
        }
    const Position extent = minus(high, low);
    const std::size_t yz = extent[1] >= extent[2] ? 1 : 2;
    return extent[0] >= extent[yz] ? 0 : yz;
}

// Partitions: the first `count` become those that lie lowest along the longest axis.
void split(std::span<Centre> centres, std::size_t count) {
    if (count >= centres.size())
        return;
    const std::size_t axis = longest_axis(centres);
    std::nth_element(centres.begin(), centres.begin() + static_cast<std::ptrdiff_t>(count), centres.end(),
                     [axis](const Centre &a, const Centre &b) {
                         return a.at[axis] < b.at[axis] || (a.at[axis] == b.at[axis] && a.triangle < b.triangle);
                     });
}

// Makes nodes of the tree spatially compact: splits blocks of a power of four into four, down to leaves.
void sort_into_blocks(std::vector<Centre> &centres, int threads) {
    std::size_t block = kFour;
    while (block < centres.size())
        block *= kFour;
    for (; block > kFour; block /= kFour) {
        const std::size_t half = block / 2, quarter = block / kFour;
        parallel_for((centres.size() + block - 1) / block, threads, [&](std::size_t b) {
            const auto all = std::span(centres).subspan(b * block, std::min(block, centres.size() - b * block));
            split(all, half);
            split(all.first(std::min(half, all.size())), quarter);
            if (all.size() > half)
                split(all.subspan(half), quarter);
        });
    }
}

// The nearest position on a triangle with corner `a` and edges `ab`, `ac`: on a corner, on an edge or inside.
Position nearest_of_triangle(const Position &p, const Position &a, const Position &ab, const Position &ac) {
    const Position ap = minus(p, a), bp = minus(ap, ab), cp = minus(ap, ac);
    const float d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
                d6 = dot(ac, cp);
    if (d1 <= 0 && d2 <= 0)
        return a;
    if (d3 >= 0 && d4 <= d3)
        return along(a, ab, 1);
    if (d6 >= 0 && d5 <= d6)
        return along(a, ac, 1);
    const float va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0)
        return along(a, ab, d1 / (d1 - d3));
    if (vb <= 0 && d2 >= 0 && d6 <= 0)
        return along(a, ac, d2 / (d2 - d6));
    if (va <= 0 && d4 >= d3 && d5 >= d6)
        return along(along(a, ab, 1), minus(ac, ab), (d4 - d3) / (d4 - d3 + (d5 - d6)));
    const float sum = va + vb + vc;
    return sum > 0 ? along(along(a, ab, vb / sum), ac, vc / sum) : a;
}

// Stack of nodes that are still to be visited.
class Waiting {
  public:
    struct Item {
        std::size_t layer, index;
    };
    void push(std::size_t layer, std::size_t index) { items_[count_++] = {layer, index}; }
    Item pop() { return items_[--count_]; }
    bool empty() const { return count_ == 0; }

  private:
    std::array<Item, kStack> items_;
    std::size_t count_ = 0;
};

} // namespace

TriangleTree::TriangleTree(std::size_t count, const std::function<Triangle(std::size_t)> &triangle, int threads) {
    if (count == 0)
        return;
    std::vector<Centre> centres(count);
    parallel_for(count, kAtOnce, threads, [&](std::size_t i) {
        const auto [a, b, c] = triangle(i);
        centres[i] = {{a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]}, static_cast<std::uint32_t>(i)};
    });
    sort_into_blocks(centres, threads);
    leaves_.resize((count + kFour - 1) / kFour);
    std::vector<Node> boxes((leaves_.size() + kFour - 1) / kFour);
    parallel_for(boxes.size(), kAtOnce, threads, [&](std::size_t n) {
        const std::size_t first = n * kFour, end = std::min(leaves_.size(), first + kFour);
        for (std::size_t l = first; l < end; ++l)
            for (std::size_t lane = 0; lane < kFour; ++lane) {
                const std::size_t at = l * kFour + lane;
                set_lane(leaves_[l], lane,
                         at < count ? triangle(centres[at].triangle) : Triangle{kNoPlace, kNoPlace, kNoPlace});
            }
        boxes[n] = boxes_of(&leaves_[first], end - first);
    });
    add_layers(std::move(boxes));
}

void TriangleTree::set_lane(Leaf &leaf, std::size_t lane, const Triangle &triangle) {
    const auto &[a, b, c] = triangle;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        leaf.corner[axis][lane] = a[axis];
        leaf.first[axis][lane] = b[axis] - a[axis];
        leaf.second[axis][lane] = c[axis] - a[axis];
    }
}

TriangleTree::Node TriangleTree::boxes_of(const Leaf *leaves, std::size_t count) {
    Node node;
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t child = 0; child < kFour; ++child) {
            float low = kNowhere, high = -kNowhere; // empty: no ray meets it
            for (std::size_t lane = 0; child < count && lane < kFour; ++lane) {
                const float corner = leaves[child].corner[axis][lane];
                if (corner == kNowhere)
                    continue;
                const float b = corner + leaves[child].first[axis][lane], c = corner + leaves[child].second[axis][lane];
                low = std::min(low, least(corner, b, c));
                high = std::max(high, most(corner, b, c));
            }
            node.low[axis][child] = low;
            node.high[axis][child] = high;
        }
    return node;
}

void TriangleTree::add_layers(std::vector<Node> boxes) {
    layers_.push_back(std::move(boxes));
    while (layers_.back().size() > 1) {
        const std::vector<Node> &fine = layers_.back();
        std::vector<Node> coarse((fine.size() + kFour - 1) / kFour);
        for (std::size_t n = 0; n < coarse.size(); ++n)
            for (std::size_t axis = 0; axis < 3; ++axis)
                for (std::size_t child = 0; child < kFour; ++child) {
                    float low = kNowhere, high = -kNowhere;
                    for (std::size_t lane = 0; n * kFour + child < fine.size() && lane < kFour; ++lane) {
                        low = std::min(low, fine[n * kFour + child].low[axis][lane]);
                        high = std::max(high, fine[n * kFour + child].high[axis][lane]);
                    }
                    coarse[n].low[axis][child] = low;
                    coarse[n].high[axis][child] = high;
                }
        layers_.push_back(std::move(coarse));
    }
}

struct TriangleTree::Ray {
    Ray(const Position &from, const Position &direction, float length) : reach(all(length)) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            // Avoid 0 * infinity.
            const float way = std::abs(direction[axis]) < 1e-12F ? 1e-12F : direction[axis];
            origin[axis] = all(from[axis]);
            towards[axis] = all(direction[axis]);
            inverse[axis] = all(1 / way);
        }
    }
    Float4x3 origin, towards, inverse;
    Float4 reach;
};

// Intersections of a ray with the triangles of a leaf.
struct TriangleTree::Crossings {
    Int4 met;
    Float4 sign;     // -1: the triangle faces the way the ray goes
    Float4 size, at; // distance at / size, in lengths of the ray's direction
};

TriangleTree::Crossings TriangleTree::cross_leaf(const Ray &ray, const Leaf &leaf) {
    const Float4x3 p = cross(ray.towards, leaf.second);
    const Float4 determinant = dot(leaf.first, p);
    const Float4x3 to = {ray.origin[0] - leaf.corner[0], ray.origin[1] - leaf.corner[1],
                         ray.origin[2] - leaf.corner[2]};
    const Float4x3 q = cross(to, leaf.first);
    // All values are multiplied by the determinant's magnitude.
    const Float4 sign = determinant < 0 ? all(-1) : all(1);
    const Float4 size = determinant * sign, u = dot(to, p) * sign, v = dot(ray.towards, q) * sign,
                 at = dot(leaf.second, q) * sign;
    return {(size > 0) & (u >= 0) & (v >= 0) & (u + v <= size) & (at >= 0) & (at <= ray.reach * size), sign, size, at};
}

// Visits the leaves along a ray until `visit(leaf)` returns true; returns whether it did.
template <class Visit> bool TriangleTree::visit_leaves(const Ray &ray, const Visit &visit) const {
    if (empty())
        return false;
    Waiting waiting;
    waiting.push(layers_.size() - 1, 0);
    while (!waiting.empty()) {
        const auto [layer, index] = waiting.pop();
        const Node &node = layers_[layer][index];
        Float4 enter = all(0), leave = ray.reach;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const Float4 one = (node.low[axis] - ray.origin[axis]) * ray.inverse[axis],
                         two = (node.high[axis] - ray.origin[axis]) * ray.inverse[axis];
            enter = most(enter, least(one, two));
            leave = least(leave, most(one, two));
        }
        const Int4 hit = (enter <= leave) & (node.low[0] <= node.high[0]);
        for (std::size_t child = 0; child < kFour; ++child) {
            if (hit[child] == 0)
                continue;
            const std::size_t next = index * kFour + child;
            if (layer > 0)
                waiting.push(layer - 1, next);
            else if (visit(leaves_[next]))
                return true;
        }
    }
    return false;
}

bool TriangleTree::blocks(const Position &from, const Position &direction, float reach) const {
    const Ray ray(from, direction, reach);
    return visit_leaves(ray, [&](const Leaf &leaf) { return any(cross_leaf(ray, leaf).met); });
}

std::optional<float> TriangleTree::last_layer(const Position &from, const Position &direction, float start,
                                              float reach) const {
    struct Side {
        float first = kNowhere, last = -kNowhere;
    };
    const auto look = [&](float length) {
        std::array<Side, 2> sides; // triangles that face against the ray, along it
        const Ray ray(from, direction, length);
        visit_leaves(ray, [&](const Leaf &leaf) {
            const Crossings crossings = cross_leaf(ray, leaf);
            for (std::size_t lane = 0; any(crossings.met) && lane < kFour; ++lane) {
                if (crossings.met[lane] == 0)
                    continue;
                Side &side = sides[crossings.sign[lane] < 0 ? 1 : 0];
                const float at = crossings.at[lane] / crossings.size[lane];
                side.first = std::min(side.first, at);
                side.last = std::max(side.last, at);
            }
            return false;
        });
        return sides;
    };
    const std::array<Side, 2> sides = look(reach);
    const std::size_t own = sides[0].first < sides[1].first ? 0 : 1;
    if (sides[own].first > start)
        return std::nullopt;
    const float end = sides[1 - own].first; // what lies beyond belongs to another surface
    return end < sides[own].last ? look(end)[own].last : sides[own].last;
}

std::optional<Position> TriangleTree::nearest(const Position &from, float within) const {
    std::optional<Position> found;
    if (empty())
        return found;
    float limit = within * within;
    const auto look_at = [&](const Leaf &leaf) {
        for (std::size_t lane = 0; lane < kFour; ++lane) {
            const auto of = [&](const Float4x3 &v) { return Position{v[0][lane], v[1][lane], v[2][lane]}; };
            const Position place = nearest_of_triangle(from, of(leaf.corner), of(leaf.first), of(leaf.second));
            const Position way = minus(place, from);
            if (const float squared = dot(way, way); squared < limit) {
                limit = squared;
                found = place;
            }
        }
    };
    Waiting waiting;
    waiting.push(layers_.size() - 1, 0);
    while (!waiting.empty()) {
        const auto [layer, index] = waiting.pop();
        const Node &node = layers_[layer][index];
        Float4 squared = all(0);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const Float4 out = most(most(node.low[axis] - all(from[axis]), all(from[axis]) - node.high[axis]), all(0));
            squared += out * out;
        }
        std::size_t first = 0;
        for (std::size_t child = 1; child < kFour; ++child)
            if (squared[child] < squared[first])
                first = child;
        if (layer == 0) {
            for (std::size_t turn = 0; turn < kFour; ++turn) // nearest first: it bounds the others
                if (const std::size_t child = first ^ turn; squared[child] < limit)
                    look_at(leaves_[index * kFour + child]);
            continue;
        }
        for (std::size_t turn = kFour; turn-- > 0;)
            if (const std::size_t child = first ^ turn; squared[child] < limit)
                waiting.push(layer - 1, index * kFour + child);
    }
    return found;
}

} // namespace pbm
