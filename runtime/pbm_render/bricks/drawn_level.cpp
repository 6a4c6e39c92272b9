#include "pbm_render/bricks/drawn_level.h"

#include "pbm_render/camera/normal_table.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace pbm {

DrawnLevel::DrawnLevel(const Model &model, int level)
    : sides_(model.levels[static_cast<std::size_t>(level)].sides),
      count_(model.levels[static_cast<std::size_t>(level)].points.size()) {
    const AttributeSet &set = model.parameters.attributes;
    const PointAttributes &points = model.levels[static_cast<std::size_t>(level)].points;
    if (has_sides())
        for_columns(
            set,
            [&](const StreamInfo &stream, std::size_t width, auto &to, const auto &from, const auto &of_sides) {
                to = from;
                if (width == 0)
                    return;
                for (std::size_t i = 0; i < sides_.size(); ++i) {
                    const std::size_t at = width * sides_.points[i];
                    if (stream.kind == StreamKind::radius) {
                        to.push_back(from[at]);
                        continue;
                    }
                    std::copy_n(of_sides.begin() + static_cast<std::ptrdiff_t>(2 * width * i), width,
                                to.begin() + static_cast<std::ptrdiff_t>(at));
                    for (std::size_t k = 0; k < width; ++k)
                        to.push_back(of_sides[width * (2 * i + 1) + k]);
                }
            },
            both_, points, sides_.values);
    const PointAttributes &of_all = has_sides() ? both_ : points;
    values_ = drawn_ = view_points(of_all, 0, of_all.size(), set);
    mark_round_points(drawn_, model.parameters, level, marked_);
    if (!has_sides())
        return;
    std::vector<std::uint16_t> normals(drawn_.normals.begin(), drawn_.normals.end());
    for (std::size_t i = 0; i < sides_.size(); ++i)
        for (const std::size_t side : {std::size_t{sides_.points[i]}, count_ + i})
            normals[side] |= is_hidden(points.normals[sides_.points[i]]) ? kHiddenBits : kSideBits;
    marked_.normals = std::move(normals);
    drawn_.normals = marked_.normals;
}

std::optional<std::size_t> DrawnLevel::second(std::size_t point) const {
    const auto found = std::lower_bound(sides_.points.begin(), sides_.points.end(), point);
    if (found == sides_.points.end() || *found != point)
        return std::nullopt;
    return count_ + static_cast<std::size_t>(found - sides_.points.begin());
}

} // namespace pbm
