#include "pbm_render/detail/detail_selection.h"

#include "pbm_format/model/normal.h"
#include "pbm_format/streams/predictions.h"
#include "pbm_render/camera/normal_table.h"
#include "pbm_render/camera/projection.h"
#include "pbm_render/camera/unit_grid.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace pbm {
namespace {

// Voxel edges: a splat reaches beyond its voxel's centre by at most its radius and this margin.
constexpr double kSplatMargin = 2;
// Upper bound of the rounding error of cosines between integer normals.
constexpr double kRounding = 1e-4;

Box root_box(const ChunkShape &shape) {
    const double edge = std::ldexp(1.0, -shape.root_depth);
    const auto [x, y, z] = morton_decode(shape.root_prefix);
    const glm::dvec3 corner = glm::dvec3(x, y, z) * edge;
    return {.least = corner, .most = corner + edge};
}

Box intersection(const Box &a, const Box &b) {
    return {.least = glm::max(a.least, b.least), .most = glm::min(a.most, b.most)};
}

// The part of space that a camera sees, and that its clip region leaves.
class Frustum {
  public:
    Frustum(const Camera &camera, int width, int height)
        : projection_(camera, width, height), eye_(projection_.eye), forward_(projection_.axes.forward) {
        const double x = projection_.middle.x / projection_.focal, y = projection_.middle.y / projection_.focal;
        const EyeAxes &axes = projection_.axes;
        inwards_ = {forward_, glm::normalize(axes.right + x * forward_), glm::normalize(-axes.right + x * forward_),
                    glm::normalize(axes.up + y * forward_), glm::normalize(-axes.up + y * forward_)};
        min_cosine_ = 1 / std::sqrt(1 + x * x + y * y);
    }

    // Whether a box lies outside the clip region, or it and a `margin` around it outside the frustum. May return false
    // for such a box.
    bool misses(const Box &box, double margin) const {
        return projection_.clip.side_of(box.centre(), box.half()) == HalfSpaces::Side::outside ||
               std::any_of(inwards_.begin(), inwards_.end(), [&](const glm::dvec3 &inwards) {
                   return glm::dot(inwards, box.centre() - eye_) + reach(box, inwards) + margin < 0;
               });
    }

    // Upper bound of the length of `edge` on the screen, in pixels, anywhere in the box; infinite around the eye.
    double largest_image(const Box &box, double edge) const {
        const glm::dvec3 to_centre = box.centre() - eye_;
        const double distance = glm::length(glm::max(glm::abs(to_centre) - box.half(), glm::dvec3(0)));
        const double depth = std::max(glm::dot(forward_, to_centre) - reach(box, forward_), distance * min_cosine_);
        return depth > 0 ? edge * projection_.focal / depth : std::numeric_limits<double>::infinity();
    }

    // Whether every normal of the cone, anywhere in the box, faces so far away that no renderer draws its point.
    bool sees_backs(const NormalCone &cone, const Box &box) const {
        const glm::dvec3 to_centre = box.centre() - eye_;
        const double distance = glm::length(to_centre), radius = glm::length(box.half());
        if (cone.cosine == kNoCone || distance <= radius || projection_.shows_backs)
            return false;
        const UnitVector &n = normal_table()[cone.axis];
        const double axis_cosine = glm::dot(glm::dvec3(n[0], n[1], n[2]), to_centre) / distance;
        const double turned =
            angle(axis_cosine) + angle(cone.cosine / 32767.0 - kRounding) + std::asin(radius / distance);
        return turned < angle(static_cast<double>(kFacingSlack) + kRounding);
    }

  private:
    static double angle(double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)); }
    static double reach(const Box &box, const glm::dvec3 &direction) {
        return glm::dot(box.half(), glm::abs(direction));
    }

    Projection projection_;
    glm::dvec3 eye_, forward_;
    std::array<glm::dvec3, 5> inwards_; // unit normals of the planes that bound the frustum
    double min_cosine_;                 // of the largest angle between the line of sight and a ray
};

class Selector {
  public:
    Selector(const ModelParameters &parameters, std::span<const LevelState> levels, const DetailView &view)
        : frustum_(in_unit_grid(view.camera, parameters), view.width, view.height), levels_(levels),
          depth_(parameters.grid.depth), finest_(std::clamp(view.finest, 1, depth_)), max_error_(view.max_error) {}

    // Shows the place of a chunk. Returns false if its parent's points must show it. All points of the chunk lie in
    // `box`. `radius_above` bounds the radius indices of the parent. The recursion is as deep as the grid: at most 16.
    bool show(ChunkPlace place, Box box, std::uint8_t radius_above);

    DetailSelection take() {
        std::stable_sort(selection_.missing.begin(), selection_.missing.end(),
                         [](const MissingChunk &a, const MissingChunk &b) {
                             return a.error > b.error || (a.error == b.error && a.place.level < b.place.level);
                         });
        add_second_sides();
        return std::move(selection_);
    }

  private:
    // Shows each part of a chunk by the chunk below it or, if that is not needed or not resident, by the chunk's own
    // points, if it is resident itself. Returns whether some part needs these points.
    bool show_children(ChunkPlace place, const Box &box, const ResidentChunk *chunk, std::uint8_t radius);
    void draw(const ResidentChunk &chunk, ChunkPlace place, std::uint32_t first, std::uint32_t last);
    void add_second_sides();
    const ChunkEntry &entry_of(ChunkPlace place) const {
        return levels_[static_cast<std::size_t>(place.level)].directory->chunks[place.index];
    }

    std::size_t chosen() const { return selection_.runs.size() + selection_.missing.size(); }

    const Frustum frustum_;
    const std::span<const LevelState> levels_;
    const int depth_, finest_;
    const double max_error_;
    DetailSelection selection_;
    std::vector<const ChunkSides *> sides_; // of the runs' chunks, or null
    bool has_sides_ = false;                // of some
};

bool Selector::show(ChunkPlace place, Box box, std::uint8_t radius_above) {
    const ChunkEntry &entry = entry_of(place);
    const ChunkSlot &slot = levels_[static_cast<std::size_t>(place.level)].chunks[place.index];
    const ResidentChunk *const chunk = slot.chunk.get();
    // Radii of a level bound those of the level below (BVG.md 6.2.3).
    const std::uint8_t radius =
        chunk != nullptr ? chunk->largest_radius : radius_predictions(place.level, place.level == depth_)[radius_above];
    const double voxel = std::ldexp(1.0, -place.level);
    if (chunk != nullptr)
        box = chunk->bounds;
    if (frustum_.misses(box, kSplatMargin * voxel + radius_fraction(radius)))
        return true;
    const double error = frustum_.largest_image(box, voxel);
    const bool too_coarse = error > max_error_ && place.level < finest_;
    if (!too_coarse && frustum_.sees_backs(entry.cone, box))
        return true;
    if (slot.refused)
        return false;
    const bool has_directory = static_cast<std::size_t>(place.level) + 1 < levels_.size();
    selection_.needs_directory |= too_coarse && !has_directory;
    if (too_coarse && has_directory) {
        const std::size_t before = chosen();
        if (!show_children(place, box, chunk, radius) && chosen() == before) // all of it is outside or faces away
            return true;
    } else if (chunk != nullptr) {
        draw(*chunk, place, 0, entry.shape.points);
    }
    if (chunk != nullptr)
        selection_.present.push_back(place);
    else
        selection_.missing.push_back({place, error, !too_coarse});
    return chunk != nullptr;
}

bool Selector::show_children(ChunkPlace place, const Box &box, const ResidentChunk *chunk, std::uint8_t radius) {
    const double voxel = std::ldexp(1.0, -place.level);
    const std::vector<ChunkEntry> &below = levels_[static_cast<std::size_t>(place.level) + 1].directory->chunks;
    // Chunks of the level below are sorted by their parents.
    const auto first = std::partition_point(
        below.begin(), below.end(), [&](const ChunkEntry &child) { return child.shape.parent_chunk < place.index; });
    bool asked = false;
    for (auto child = first; child != below.end() && child->shape.parent_chunk == place.index; ++child) {
        const auto index = static_cast<std::uint32_t>(child - below.begin());
        const Box part = intersection(root_box(child->shape), box);
        if (frustum_.misses(part, kSplatMargin * voxel + radius_fraction(radius)))
            continue;
        // A chunk may be too coarse as a whole but fine enough in this part.
        const bool too_coarse = frustum_.largest_image(part, voxel) > max_error_;
        if (too_coarse && show({place.level + 1, index}, part, radius))
            continue;
        asked = true;
        if (chunk == nullptr)
            continue;
        const auto points_before = static_cast<std::uint32_t>(child->first_node - entry_of(place).first_point);
        draw(*chunk, place, points_before, points_before + child->shape.nodes);
    }
    return asked;
}

void Selector::draw(const ResidentChunk &chunk, ChunkPlace place, std::uint32_t first, std::uint32_t last) {
    const ChunkEntry &entry = entry_of(place);
    std::vector<PointRun> &runs = selection_.runs;
    if (!runs.empty() && runs.back().entry == &entry && runs.back().last == first)
        runs.back().last = last;
    else
        runs.push_back({.chunk = &chunk.view,
                        .entry = &entry,
                        .level = place.level,
                        .first = first,
                        .last = last,
                        .offsets = &chunk.offsets,
                        .has_sides = chunk.sides != nullptr,
                        .hides_points = chunk.hides_points});
    sides_.resize(runs.size());
    sides_.back() = chunk.sides.get();
    has_sides_ |= chunk.sides != nullptr;
}

// Puts the second sides of its points behind each run.
void Selector::add_second_sides() {
    if (!has_sides_)
        return;
    const std::vector<PointRun> firsts = std::exchange(selection_.runs, {});
    for (std::size_t i = 0; i < firsts.size(); ++i) {
        const PointRun &run = firsts[i];
        selection_.runs.push_back(run);
        if (sides_[i] == nullptr)
            continue;
        const auto [first, last] = sides_[i]->range(run.first, run.last);
        if (first < last)
            selection_.runs.push_back({.chunk = &sides_[i]->view,
                                       .entry = run.entry,
                                       .level = run.level,
                                       .first = first,
                                       .last = last,
                                       .offsets = &sides_[i]->offsets,
                                       .origins = sides_[i]->points.data(),
                                       .has_sides = true,
                                       .hides_points = run.hides_points});
    }
}

} // namespace

DetailSelection select_detail(const ModelParameters &parameters, std::uint8_t root_radius,
                              std::span<const LevelState> levels, const DetailView &view) {
    if (levels.size() < 2) {
        DetailSelection nothing;
        nothing.needs_directory = true;
        return nothing;
    }
    Selector selector(parameters, levels, view);
    selector.show({1, 0}, {.least = glm::dvec3(0), .most = glm::dvec3(1)}, root_radius);
    return selector.take();
}

} // namespace pbm
