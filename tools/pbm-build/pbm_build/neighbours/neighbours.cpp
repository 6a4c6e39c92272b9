#include "pbm_build/neighbours/neighbours.h"

#include <algorithm>
#include <limits>

namespace pbm::build {
namespace {

// Distances are first compared in single precision. The differences are exact, so the relative error is below this.
constexpr float kRounding = 1 + 1e-6F;

} // namespace

PointNeighbours::PointNeighbours(std::vector<LatticePoint> points) : points_(std::move(points)) {
    if (points_.empty())
        return;
    leaves_.resize((points_.size() + kFan - 1) / kFan);
    for (std::size_t i = 0; i < leaves_.size() * kFan; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
            leaves_[i / kFan][axis][i % kFan] = points_[std::min(i, points_.size() - 1)][static_cast<int>(axis)];
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
    const auto of_leaf = [&](std::size_t i, std::size_t axis) -> const Lanes & { return leaves_[i][axis]; };
    levels_.push_back(enclose(leaves_.size(), of_leaf, of_leaf));
    while (levels_.back().size() > 1) {
        const std::vector<Boxes> &below = levels_.back();
        std::vector<Boxes> groups = enclose(
            below.size(), [&](std::size_t i, std::size_t axis) -> const Lanes & { return below[i].low[axis]; },
            [&](std::size_t i, std::size_t axis) -> const Lanes & { return below[i].high[axis]; });
        levels_.push_back(std::move(groups));
    }
}

// One search: the sorted candidates, and the maximum distance of a new one.
class PointNeighbours::Search {
  public:
    Search(const PointNeighbours &tree, std::size_t point, std::span<NearPoint> found)
        : tree_(tree), point_(point), at_(tree.points_[point]), found_(found) {}

    // Searches the point's own leaf and its two neighbours.
    void scan_beside() {
        const std::size_t own = point_ / kFan;
        first_ = own - std::min<std::size_t>(own, 1);
        last_ = std::min(own + 1, tree_.leaves_.size() - 1);
        scan(own);
        if (first_ < own)
            scan(first_);
        if (last_ > own)
            scan(last_);
    }

    // Searches all other leaves, the nearest of each group first.
    void scan_others() {
        struct Box {
            float squared;
            std::uint32_t level; // of the group inside, plus 1; 0: a leaf
            std::size_t index;
        };
        std::array<Box, kFan * 9> stack; // 16^9 is more than there are points
        std::size_t depth = 0;
        stack[depth++] = {0, static_cast<std::uint32_t>(tree_.levels_.size()), 0};
        while (depth > 0) {
            const Box box = stack[--depth];
            if (box.squared > limit_)
                continue;
            if (box.level == 0) {
                scan(box.index);
                continue;
            }
            const std::uint32_t level = box.level - 1;
            const std::array<float, kFan> squared = distances(tree_.levels_[level][box.index]);
            const std::size_t begin = box.index * kFan, old_depth = depth,
                              count = std::min(kFan, tree_.boxes_of_level_[level] - begin);
            for (std::size_t i = 0; i < count; ++i) {
                const std::size_t child = begin + i;
                if (squared[i] > limit_ || (level == 0 && child >= first_ && child <= last_))
                    continue;
                std::size_t place = depth++;
                for (; place > old_depth && stack[place - 1].squared < squared[i]; --place)
                    stack[place] = stack[place - 1];
                stack[place] = {squared[i], level, child};
            }
        }
    }

    std::size_t count() const { return count_; }

  private:
    // Squared distances to the boxes of a group.
    std::array<float, kFan> distances(const Boxes &boxes) const {
        const auto outside = [](std::int32_t below, std::int32_t above) {
            return std::max(std::max(static_cast<float>(below), static_cast<float>(above)), 0.0F);
        };
        const LatticePoint at = at_;
        std::array<float, kFan> squared;
        for (std::size_t i = 0; i < kFan; ++i) {
            const float x = outside(boxes.low[0][i] - at.x, at.x - boxes.high[0][i]),
                        y = outside(boxes.low[1][i] - at.y, at.y - boxes.high[1][i]),
                        z = outside(boxes.low[2][i] - at.z, at.z - boxes.high[2][i]);
            squared[i] = x * x + y * y + z * z;
        }
        return squared;
    }

    void scan(std::size_t index) {
        const Leaf &leaf = tree_.leaves_[index];
        const LatticePoint at = at_;
        std::array<float, kFan> squared;
        for (std::size_t i = 0; i < kFan; ++i) {
            const auto x = static_cast<float>(leaf[0][i] - at.x), y = static_cast<float>(leaf[1][i] - at.y),
                       z = static_cast<float>(leaf[2][i] - at.z);
            squared[i] = x * x + y * y + z * z;
        }
        const std::size_t count = std::min(kFan, tree_.points_.size() - index * kFan);
        for (std::size_t i = 0; i < count; ++i)
            if (squared[i] <= limit_ && index * kFan + i != point_)
                add(index * kFan + i);
    }

    // The order of two points at equal distance.
    bool comes_before(std::size_t a, std::size_t b) const {
        const LatticePoint &p = tree_.points_[a], &q = tree_.points_[b];
        return p.z != q.z ? p.z < q.z : p.y != q.y ? p.y < q.y : p.x != q.x ? p.x < q.x : a < b;
    }

    void add(std::size_t point) {
        const glm::dvec3 d(tree_.points_[point] - at_);
        const double squared = (d.x * d.x + d.y * d.y) + d.z * d.z;
        const bool full = count_ == found_.size();
        if (full && (count_ == 0 || squared > found_.back().squared_distance ||
                     (squared == found_.back().squared_distance && !comes_before(point, found_.back().point))))
            return;
        std::size_t place = full ? count_ - 1 : count_++;
        for (; place > 0 && found_[place - 1].squared_distance > squared; --place)
            found_[place] = found_[place - 1];
        for (;
             place > 0 && found_[place - 1].squared_distance == squared && comes_before(point, found_[place - 1].point);
             --place)
            found_[place] = found_[place - 1];
        found_[place] = {static_cast<std::uint32_t>(point), squared};
        if (count_ == found_.size())
            limit_ = static_cast<float>(found_.back().squared_distance) * kRounding;
    }

    const PointNeighbours &tree_;
    std::size_t point_;
    LatticePoint at_;
    std::span<NearPoint> found_;
    std::size_t count_ = 0;
    std::size_t first_ = 0, last_ = 0;                     // leaves that scan_beside has searched
    float limit_ = std::numeric_limits<float>::infinity(); // squared
};

std::size_t PointNeighbours::nearest(std::size_t point, std::span<NearPoint> found) const {
    Search search(*this, point, found);
    search.scan_beside();
    search.scan_others();
    return search.count();
}

std::size_t PointNeighbours::nearest_in_order(std::size_t point, std::span<NearPoint> found) const {
    Search search(*this, point, found);
    search.scan_beside();
    return search.count();
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
