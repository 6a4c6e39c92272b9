#include "pbm_render/tables/table_renderer.h"

#include "pbm_render/bricks/drawn_level.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/shading/level_shader.h"
#include "pbm_render/splats/near_splat.h"
#include "pbm_render/tables/facing_table.h"
#include "pbm_render/tables/splat_blocks.h"
#include "pbm_render/tables/splat_kernels.h"
#include "pbm_render/tables/transform_table.h"
#include "pbm_surface/surface_offsets.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace pbm {
namespace {

// The builder's splat radius where the scan is dense, voxel edges.
constexpr double kDenseRadius = 0.87;
constexpr std::size_t kNoRadius = 256; // not an index
// Factor on the splat radius: the dissertation's discs reach the neighbours across all corners of the voxel.
constexpr float kNeighbourReach = 2;

// Kernels for the range of depths that the grid covers.
SplatKernels make_kernels(const Grid &grid, const Projection &projection, int width, int height) {
    const double middle = projection.point(glm::dvec3(grid.edge() / 2)).z, half = grid.edge() * std::sqrt(0.75);
    const double rear = std::max(middle + half, grid.edge());
    return {projection, width, height, std::clamp(middle - half, 0.001 * rear, 0.999 * rear), rear};
}

// One traversal of the octree: values of the whole frame, and the cursors.
class TableWalk {
  public:
    // `own.level` is a level of the model.
    TableWalk(const Model &model, const DrawnLevel &points, const Projection &projection, const TableOptions &own,
              std::span<const std::int8_t> offsets, Framebuffer &target);

    void draw_root() { draw_sides(0, table_.centre); }
    // Draws octant grid number `octant` of those with points; `place` is its child number.
    void draw_octant(std::size_t octant, unsigned place, const std::vector<std::vector<std::uint64_t>> &starts);

    // The model has points with kHiddenBits.
    void leave_out_hidden() { is_cut_ = true; }

    std::uint64_t drawn_points = 0;

  private:
    void prepare_octant(const glm::dvec3 &centre, double half_edge);
    void draw_node(int level, const glm::vec4 &centre);
    void draw_points(unsigned mask, const glm::vec4 &centre);
    void draw_cut_points(unsigned mask, const glm::vec4 &centre);
    void draw_point(std::size_t index, Facing facing, const glm::vec4 &centre);
    void draw_sides(std::size_t index, const glm::vec4 &centre);
    void draw_odd_point(std::size_t index, const glm::vec4 &centre);
    void draw_around_eye(std::size_t index, const glm::vec4 &centre);
    void draw_placed(std::size_t normal, const ScreenPoint &point, float facing, SplatSize size);
    void draw(const BlockShape &shape, const ScreenPoint &point);

    const Projection &projection_;
    bool is_cut_; // some points may be hidden, or the camera has a clip region
    const bool shows_backs_;
    const Grid grid_; // unit_grid
    const int level_;
    const DrawnLevel &level_points_;
    const PointView &points_;                  // that are drawn
    const std::uint16_t *const point_normals_; // their attributes
    const std::uint8_t *const point_radii_;
    const std::span<const std::int8_t> offsets_; // of the points drawn; may be empty
    Framebuffer &target_;

    TransformTable table_;
    const FrameGeometry frame_;
    std::vector<ScreenNormal> normals_;
    const std::array<float, 256> &radii_; // grid edges
    std::array<float, 256> pixel_splats_; // 1 / depth below which a splat of this radius covers one pixel
    float voxel_;                         // edge, this level
    std::optional<SplatKernels> kernels_; // for Splats::kernels

    // State of the current octant grid:
    std::vector<Facing> facing_;           // mark_facing
    std::vector<BlockShape> shapes_;       // [kNormalCount], for points of radius table_radius_
    std::size_t table_radius_ = kNoRadius; // index

    std::array<const std::uint8_t *, kMaxDepth + 1> masks_{}; // [level of the children]
    std::array<std::size_t, kMaxDepth + 1> cursor_{};         // next node of each level
};

TableWalk::TableWalk(const Model &model, const DrawnLevel &points, const Projection &projection,
                     const TableOptions &own, std::span<const std::int8_t> offsets, Framebuffer &target)
    : projection_(projection), is_cut_(!projection.clip.empty()), shows_backs_(projection.shows_backs),
      grid_(unit_grid(model.parameters.grid)), level_(own.level), level_points_(points), points_(points.drawn()),
      point_normals_(points_.normals.data()), point_radii_(points_.radii.data()), offsets_(offsets), target_(target),
      table_(grid_, projection), frame_(projection, target.width, target.height),
      normals_(transform_normals(projection)), radii_(radius_table()),
      voxel_(static_cast<float>(grid_.voxel_size_at(own.level))),
      facing_(projection.has_round_points ? 4 * kNormalCount : 2 * kNormalCount, Facing::both), shapes_(kNormalCount) {
    for (std::size_t i = 0; i < radii_.size(); ++i)
        pixel_splats_[i] = 0.5F / (static_cast<float>(projection.focal) * radii_[i]);
    if (own.splats == Splats::kernels)
        kernels_.emplace(make_kernels(grid_, projection, target.width, target.height));
    for (std::size_t i = 1; i < model.levels.size(); ++i)
        masks_[i] = model.levels[i].masks.data();
}

void TableWalk::draw_octant(std::size_t octant, unsigned place, const std::vector<std::vector<std::uint64_t>> &starts) {
    const double half = grid_.edge() / 4;
    const glm::dvec3 middle = glm::dvec3(grid_.origin[0], grid_.origin[1], grid_.origin[2]) + grid_.edge() / 2;
    prepare_octant(middle + glm::dvec3(place & 1 ? half : -half, place & 2 ? half : -half, place & 4 ? half : -half),
                   half);
    for (std::size_t level = 1; level < starts.size(); ++level)
        cursor_[level] = static_cast<std::size_t>(starts[level][octant]);
    const glm::vec4 centre = table_.centre + table_.child[1][place];
    if (level_ == 1)
        draw_sides(octant, centre);
    else
        draw_node(1, centre);
}

// Prepares an octant grid: marks the normals that face away, and computes each other normal's splat at the octant's
// centre for the radius of dense parts. Other radii, and octants that cover a wide angle, get shapes point by point.
void TableWalk::prepare_octant(const glm::dvec3 &centre, double half_edge) {
    constexpr double kNarrow = 0.3; // radians, half the angle of the octant
    mark_facing(projection_.eye, centre, half_edge, facing_);
    table_radius_ = kNoRadius;
    const std::size_t radius = radius_index(kDenseRadius * voxel_ / grid_.edge());
    const double reach = half_edge * std::sqrt(3.0);
    const glm::dvec3 image = projection_.point(centre);
    const bool narrow = reach <= kNarrow * glm::length(centre - projection_.eye);
    if (kernels_ || !offsets_.empty() || !narrow ||
        image.z - reach <= static_cast<double>(kMinRadii * radii_[radius] + kMinVoxels * voxel_))
        return;
    table_radius_ = radius;
    const glm::vec2 pixel(image.x / image.z, image.y / image.z);
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        if (facing_[i] == Facing::away)
            continue;
        const ScreenNormal &normal = normals_[i];
        const float facing = glm::dot(normal.plane, glm::vec3(pixel, 1));
        shapes_[i] =
            BlockShape(project_splat(projection_, normal, pixel, facing, {radii_[table_radius_], voxel_, false}));
    }
}

// Traverses depth first, the order of the nodes, so one cursor per level suffices. Recursion is as deep as the grid.
void TableWalk::draw_node(int level, const glm::vec4 &centre) {
    const auto below = static_cast<std::size_t>(level) + 1;
    const auto &offset = table_.child[below];
    unsigned mask = masks_[below][cursor_[below - 1]++];
    if (level + 1 == level_)
        return draw_points(mask, centre);
    for (; mask != 0; mask &= mask - 1)
        draw_node(level + 1, centre + offset[static_cast<std::size_t>(std::countr_zero(mask))]);
}

// Draws the children of a node of the last level but one.
void TableWalk::draw_points(unsigned mask, const glm::vec4 &centre) {
    if (is_cut_ || level_points_.has_sides()) [[unlikely]]
        return draw_cut_points(mask, centre);
    const auto &offset = table_.child[static_cast<std::size_t>(level_)];
    const std::uint16_t *const normals = point_normals_;
    const Facing *const facing = facing_.data();
    std::size_t point = cursor_[static_cast<std::size_t>(level_)];
    for (; mask != 0; mask &= mask - 1, ++point)
        if (const Facing way = facing[normals[point]]; way != Facing::away || shows_backs_)
            draw_point(point, way, centre + offset[static_cast<std::size_t>(std::countr_zero(mask))]);
    cursor_[static_cast<std::size_t>(level_)] = point;
}

// The same without hidden points and those outside of the clip region, and where points have sides.
[[gnu::noinline]] void TableWalk::draw_cut_points(unsigned mask, const glm::vec4 &centre) {
    const auto &offset = table_.child[static_cast<std::size_t>(level_)];
    std::size_t &point = cursor_[static_cast<std::size_t>(level_)];
    const std::span<const HalfSpace> borders = projection_.clip.all();
    for (; mask != 0; mask &= mask - 1, ++point) {
        const glm::vec4 at = centre + offset[static_cast<std::size_t>(std::countr_zero(mask))];
        const bool is_inside = std::all_of(borders.begin(), borders.end(), [&](const HalfSpace &half) {
            return glm::dot(projection_.plane(half.normal), glm::dvec3(at)) + glm::dot(half.normal, projection_.eye) +
                       half.offset >=
                   0;
        });
        if (is_inside)
            draw_sides(point, at);
    }
}

// `centre`: the voxel's centre in screen space (u, v, w). Writes the point's index to the splat's visible pixels.
inline void TableWalk::draw_point(std::size_t index, Facing facing, const glm::vec4 &centre) {
    const std::size_t normal = point_normals_[index];
    const std::size_t radius = point_radii_[index];
    if (radius != table_radius_ || facing == Facing::both || facing == Facing::away)
        return draw_odd_point(index, centre);
    const float depth = centre.z;
    const float inverse_depth = 1 / depth;
    const glm::vec2 pixel(centre.x * inverse_depth, centre.y * inverse_depth);
    if (facing == Facing::some) {
        // Cosine of normal and ray at this point.
        const glm::vec3 &plane = normals_[normal].plane;
        if (plane.x * pixel.x + plane.y * pixel.y + plane.z > kFacingSlack)
            return shows_backs_ ? draw_odd_point(index, centre) : void();
    }
    draw(shapes_[normal], {pixel, depth, inverse_depth, static_cast<std::uint32_t>(index)});
}

// Draws a point, and its other side if it has two.
void TableWalk::draw_sides(std::size_t index, const glm::vec4 &centre) {
    if (is_hidden(point_normals_[index]))
        return;
    draw_odd_point(index, centre);
    if (const auto second = level_points_.second(index))
        draw_odd_point(*second, centre);
}

// Draws a point whose shape is not in the table.
void TableWalk::draw_odd_point(std::size_t index, const glm::vec4 &centre) {
    const float radius = radii_[point_radii_[index]];
    const float depth = centre.z;
    if (depth <= kMinRadii * radius + kMinVoxels * voxel_)
        return draw_around_eye(index, centre);
    const glm::vec2 pixel(centre.x / depth, centre.y / depth);
    auto normal = static_cast<std::size_t>(point_normals_[index] & frame_.normal_mask);
    float facing = glm::dot(normals_[normal].plane, glm::vec3(pixel, 1));
    const bool two_sided = (point_normals_[index] & kTwoSidedBit) != 0;
    const bool is_back = shows_backs_ && !two_sided && facing > kFacingSlack;
    if ((point_normals_[index] & kSideBit) != 0 && facing > kSideSlack)
        return;
    if (is_back || (two_sided && facing > 0)) {
        normal ^= kOppositeNormal;
        facing = -facing;
    }
    if (facing > kFacingSlack)
        return;
    const ScreenPoint point{pixel, depth, 1 / depth, static_cast<std::uint32_t>(index)};
    const SplatSize size{radius, is_back ? -voxel_ : voxel_, two_sided};
    if (!kernels_ && !offsets_.empty())
        return draw_placed(normal, point, facing, size);
    if (!kernels_)
        return draw(BlockShape(project_splat(projection_, normals_[normal], pixel, facing, size)), point);
    ++drawn_points;
    const float pixels = kNeighbourReach * radius * static_cast<float>(projection_.focal) / depth;
    kernels_->draw(normal, pixel, depth, pixels, static_cast<std::uint32_t>(index), target_);
}

// Draws a point around the eye.
[[gnu::noinline]] void TableWalk::draw_around_eye(std::size_t index, const glm::vec4 &centre) {
    std::optional<float> offset;
    if (!offsets_.empty())
        offset = offset_of(offsets_[level_points_.origin(index)]);
    drawn_points += draw_near({glm::vec3(centre), point_normals_[index], radii_[point_radii_[index]], offset,
                               static_cast<std::uint32_t>(index)},
                              voxel_, shows_backs_, frame_, target_);
}

inline void TableWalk::draw(const BlockShape &shape, const ScreenPoint &point) {
    ++drawn_points;
    if (point.inverse_depth < pixel_splats_[point_radii_[point.index]])
        draw_pixel(shape, point, target_);
    else
        draw_splat<false>(shape, point, target_);
}

// Draws a splat at its surface offset. Not inlined, so that splats without offsets do not slow down.
[[gnu::noinline]] void TableWalk::draw_placed(std::size_t normal, const ScreenPoint &point, float facing,
                                              SplatSize size) {
    ++drawn_points;
    const std::size_t index = point.index;
    size.offset = offset_of(offsets_[level_points_.origin(index)]);
    const BlockShape shape(project_splat(projection_, normals_[normal], point.pixel, facing, size));
    if (point.inverse_depth < pixel_splats_[point_radii_[index]])
        draw_pixel(shape, point, target_);
    else
        draw_splat<true>(shape, point, target_, kPlacedCone * voxel_);
}

// Whether four pixels are all empty.
bool are_empty(const float *depths) {
    Float4 four;
    std::memcpy(&four, depths, sizeof four);
    const Long2 drawn = reinterpret_cast<Long2>(four < std::numeric_limits<float>::infinity());
    return (drawn[0] | drawn[1]) == 0;
}

// Replaces the point indices in `target` by colours; so it shades visible pixels only. `shares_colours`: neighbours
// that show the same point are shaded once. `edge`: of the grid, model units.
void resolve(const LevelShader &shader, bool shares_colours, float edge, Framebuffer &target) {
    const std::size_t pixels = target.pixels();
    float *const depths = target.depth.data();
    std::uint32_t *const colours = target.colour.data();
    constexpr auto kEmptyBits = std::bit_cast<std::uint32_t>(std::numeric_limits<float>::infinity());
    std::uint32_t last = 0xFFFFFFFF, shaded = 0;
    for (std::size_t at = 0; at < pixels; ++at) {
        if (std::bit_cast<std::uint32_t>(depths[at]) == kEmptyBits) { // one integer comparison
            while (at + 4 < pixels && are_empty(depths + at + 1)) // skips most of the background, four pixels at once
                at += 4;
            continue;
        }
        if (!shares_colours || colours[at] != last) {
            last = colours[at];
            shaded = shader.shade(last, target.centre(at), depths[at]);
        }
        colours[at] = shaded;
        depths[at] *= edge; // to model units
    }
}

} // namespace

TableRenderer::TableRenderer(const Model &model, std::shared_ptr<const ModelSurroundings> surroundings)
    : model_(model), surroundings_(std::move(surroundings)), appearance_(model.parameters),
      offsets_(model.levels.size()) {
    LevelMasks masks;
    for (const Level &level : model.levels) {
        masks.push_back(level.masks);
        const std::vector<std::uint16_t> &normals = level.points.normals;
        hides_points_ = hides_points_ || std::any_of(normals.begin(), normals.end(), is_hidden);
    }
    if (masks.size() > 1)
        octant_starts_ = subtree_starts(masks, 1);
}

void TableRenderer::set_offsets(int level, std::vector<std::int8_t> offsets) {
    const auto at = static_cast<std::size_t>(level);
    assert(offsets.empty() || offsets.size() == model_.levels[at].points.size());
    offsets_[at] = std::move(offsets);
}

RenderStatistics TableRenderer::render(const Camera &camera, const RenderOptions &options, Framebuffer &target,
                                       const TableOptions &own) const {
    const int level = std::clamp(own.level, 0, static_cast<int>(model_.levels.size()) - 1);
    clear(options, target);
    const Camera unit_camera = in_unit_grid(camera, model_.parameters);
    const Projection projection(unit_camera, target.width, target.height);
    const DrawnLevel points(model_, level);
    TableWalk walk(model_, points, projection, {level, own.splats}, offsets_[static_cast<std::size_t>(level)], target);
    if (hides_points_)
        walk.leave_out_hidden();
    if (level == 0) {
        walk.draw_root();
    } else {
        const unsigned mask = model_.levels[1].masks[0];
        unsigned nearest = 0; // the octant on the eye's side of all three planes that split the cube
        for (unsigned axis = 0; axis < 3; ++axis)
            if (unit_camera.position[static_cast<int>(axis)] > 0.5)
                nearest |= 1U << axis;
        // Front to back: an octant can be hidden only by octants that are nearer on every axis where they differ.
        for (const unsigned flip : {0U, 1U, 2U, 4U, 3U, 5U, 6U, 7U}) {
            const unsigned place = nearest ^ flip;
            if ((mask >> place & 1U) != 0)
                walk.draw_octant(static_cast<std::size_t>(std::popcount(mask & ((1U << place) - 1))), place,
                                 octant_starts_);
        }
    }
    const Appearance appearance = appearance_in_frame(model_.parameters, options, projection.axes, appearance_);
    std::unique_ptr<const FrameSurroundings> surroundings;
    if (surroundings_)
        surroundings = surroundings_->in_frame(appearance, projection, options);
    const auto edge = static_cast<float>(model_.parameters.grid.edge());
    const PointShader shader(model_.parameters, appearance, projection, surroundings.get(), options, true);
    resolve(LevelShader(model_, level, points, appearance, shader), !shader.is_positional(), edge, target);
    if (surroundings)
        surroundings->draw_behind(target, edge);
    return {level, model_.levels[static_cast<std::size_t>(level)].points.size(), walk.drawn_points};
}

} // namespace pbm
