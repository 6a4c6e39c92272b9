#include "pbm_build/neighbours/neighbours.h"

#include <algorithm>
#include <bit>

namespace pbm::build {
namespace {

// Squared distances: of the neighbours of a point, over those of the point before; of the leaves collected, over those
// that a point needs; of a second attempt, over those of the first.
constexpr float kSpread = 1.4F, kSpare = 2, kWider = 3;

} // namespace

PointNeighbours::PointNeighbours(std::vector<LatticePoint> points) : points_(std::move(points)) {
    if (points_.empty())
        return;
    leaves_.resize((points_.size() + kFan - 1) / kFan);
    for (std::size_t i = 0; i < leaves_.size() * kFan; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
            leaves_[i / kFan].at[axis][i % kFan] = points_[std::min(i, points_.size() - 1)][static_cast<int>(axis)];
    // Padding repeats the last box.
    const auto enclose = [&](std::size_t count, const auto &low_of, const auto &high_of) {
        std::vector<Boxes> groups((count + kFan - 1) / kFan);
        for (std::size_t i = 0; i < groups.size() * kFan; ++i)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const Lanes &low = low_of(std::min(i, count - 1), axis), &high = high_of(std::min(i, count - 1), axis);
                groups[i / kFan].low[axis][i % kFan] = *std::min_element(low.begin(), low.end());
                groups[i / kFan].high[axis][i % kFan] = *std::max_element(high.begin(), high.end());
            }
        boxes_of_level_.push_back(count);
        return groups;
    };
    const auto of_leaf = [&](std::size_t i, std::size_t axis) -> const Lanes & { return leaves_[i].at[axis]; };
    levels_.push_back(enclose(leaves_.size(), of_leaf, of_leaf));
    while (levels_.back().size() > 1) {
        const std::vector<Boxes> &below = levels_.back();
        std::vector<Boxes> groups = enclose(
            below.size(), [&](std::size_t i, std::size_t axis) -> const Lanes & { return below[i].low[axis]; },
            [&](std::size_t i, std::size_t axis) -> const Lanes & { return below[i].high[axis]; });
        levels_.push_back(std::move(groups));
    }
}

namespace {

// The order of two points at equal distance.
bool comes_before(const std::vector<LatticePoint> &points, std::size_t a, std::size_t b) {
    const LatticePoint &p = points[a], &q = points[b];
    return p.z != q.z ? p.z < q.z : p.y != q.y ? p.y < q.y : p.x != q.x ? p.x < q.x : a < b;
}

} // namespace

Box PointNeighbours::box_of(std::size_t leaf) const {
    const Boxes &group = levels_[0][leaf / kFan];
    const auto corner = [&](const std::array<Lanes, 3> &of) {
        return LatticePoint(of[0][leaf % kFan], of[1][leaf % kFan], of[2][leaf % kFan]);
    };
    return {corner(group.low), corner(group.high)};
}

void NeighbourCursor::enter(std::size_t leaf) {
    if (leaf == leaf_)
        return;
    leaf_ = leaf;
    reach_ = -1;
    beside_.clear();
    for (std::size_t other = leaf - std::min<std::size_t>(leaf, 1); other < std::min(leaf + 2, tree_.leaves_.size());
         ++other)
        beside_.add(static_cast<std::uint32_t>(other), tree_.box_of(other));
}

void NeighbourCursor::collect(const Box &own, float limit) {
    struct Group {
        std::size_t level, index;
    };
    std::array<Group, kFan * 9> stack; // 16^9 is more than there are points
    std::size_t depth = 0;
    stack[depth++] = {tree_.levels_.size() - 1, 0};
    near_.clear();
    while (depth > 0) {
        const auto [level, index] = stack[--depth];
        const std::size_t first = index * kFan, count = std::min(kFan, tree_.boxes_of_level_[level] - first);
        std::uint32_t within = boxes_within(tree_.levels_[level][index], own, limit) & ((1U << count) - 1);
        for (; within != 0; within &= within - 1) {
            const std::size_t child = first + static_cast<std::size_t>(std::countr_zero(within));
            if (level == 0)
                near_.add(static_cast<std::uint32_t>(child), tree_.box_of(child));
            else
                stack[depth++] = {level - 1, child};
        }
    }
    reach_ = limit;
}

// Fills `found` with the nearest points of some leaves. All of them within `limit` are considered.
std::size_t NeighbourCursor::scan(const LeafList &leaves, const Query &query, float limit, std::span<NearPoint> found) {
    const std::vector<LatticePoint> &points = tree_.points_;
    const LatticePoint at = query.at;
    std::size_t count = 0;
    for (std::size_t next = 0; next < leaves.leaves.size();) {
        next = points_within(tree_.leaves_.data(), leaves, next, at, limit, candidates_);
        for (std::size_t c = 0; c < candidates_.count; ++c) {
            const std::size_t other = candidates_.points[c];
            if (other == query.excluded || other >= points.size())
                continue;
            const glm::dvec3 d(points[other] - at);
            const double squared = (d.x * d.x + d.y * d.y) + d.z * d.z;
            if (count == found.size()) {
                const double last = found.back().squared_distance;
                if (squared > last * Candidates::kOrder)
                    break; // and so are all further ones
                if (squared > last || (squared == last && !comes_before(points, other, found.back().point)))
                    continue;
                --count;
            }
            std::size_t place = count++;
            for (; place > 0; --place) {
                const NearPoint &before = found[place - 1];
                if (before.squared_distance < squared ||
                    (before.squared_distance == squared && comes_before(points, before.point, other)))
                    break;
                found[place] = before;
            }
            found[place] = {static_cast<std::uint32_t>(other), squared};
        }
        if (count == found.size())
            limit = std::min(limit, static_cast<float>(found.back().squared_distance) * kRounding);
    }
    return count;
}

std::size_t NeighbourCursor::nearest_in_order(std::size_t point, std::span<NearPoint> found) {
    enter(point / kFan);
    return scan(beside_, {tree_.points_[point], point}, kUnlimited, found);
}

std::size_t NeighbourCursor::nearest_within(const LatticePoint &at, float limit, std::span<NearPoint> found) {
    leaf_ = kNoLeaf;
    collect({at, at}, limit);
    return scan(near_, {at, kNoPoint}, limit, found);
}

std::size_t NeighbourCursor::nearest(std::size_t point, std::span<NearPoint> found) {
    enter(point / kFan);
    const auto distance_of = [&](std::size_t i) { return static_cast<float>(found[i].squared_distance) * kRounding; };
    const auto distance_of_last = [&] { return distance_of(found.size() - 1); };
    float limit = predicted_, beside = kUnlimited;
    std::size_t count = 0;
    for (bool first = true;; first = false) {
        if (first ? !(limit < kUnlimited) : count < found.size()) { // no prediction, or one too small
            std::size_t in_order = found.size();
            if (!(beside < kUnlimited) && (in_order = nearest_in_order(point, found)) == found.size())
                beside = distance_of_last();
            if (first && (in_order == found.size() || in_order == 0))
                limit = beside;
            else // without a limit all leaves would be collected
                limit = std::min(std::max(1.0F, kWider * (first ? distance_of(in_order - 1) : limit)), beside);
        }
        if (limit > reach_)
            collect(tree_.box_of(leaf_), limit * kSpare);
        count = scan(near_, {tree_.points_[point], point}, limit, found);
        if (count == found.size() && distance_of_last() <= limit)
            break;
        if (!(limit < kUnlimited))
            break;
        if (count == found.size())
            limit = distance_of_last();
    }
    predicted_ = count == found.size() ? distance_of_last() * kSpread : kUnlimited;
    return count;
}

std::vector<LatticePoint> centres_of(std::span<const MortonCode> codes) {
    std::vector<LatticePoint> centres;
    centres.reserve(codes.size());
    for (const MortonCode code : codes) {
        const auto v = morton_decode(code);
        centres.emplace_back(v[0], v[1], v[2]);
    }
    return centres;
}

} // namespace pbm::build
