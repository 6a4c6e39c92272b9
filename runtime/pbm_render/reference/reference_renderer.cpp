#include "pbm_render/reference/reference_renderer.h"

#include "pbm_render/bricks/drawn_level.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/shading/level_shader.h"
#include "pbm_render/splats/near_splat.h"
#include "pbm_render/splats/splat.h"
#include "pbm_surface/surface_offsets.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace pbm {
namespace {

// Walks the octree and draws the points of one level. Lengths and depths are edges of the grid, whose cube has a corner
// at the origin. `target.colour` gets the index of the point that each pixel shows.
class PlainWalk {
  public:
    // `offsets`: of the points drawn; may be empty.
    PlainWalk(const Model &model, int level, const DrawnLevel &points, std::span<const std::int8_t> offsets,
              const Projection &projection, Framebuffer &target)
        : model_(model), level_(level), drawn_(points), points_(points.drawn()), offsets_(offsets),
          projection_(projection), frame_(projection, target.width, target.height),
          normals_(transform_normals(projection)), voxel_(std::ldexp(1.0F, -level)), target_(target) {}

    // Returns how many points are drawn.
    std::uint64_t draw_all() {
        draw_node(0, glm::dvec3(0.5), glm::vec3(projection_.point(glm::dvec3(0.5))));
        return drawn_points_;
    }

  private:
    void draw_node(int level, const glm::dvec3 &centre, const glm::vec3 &image);
    bool is_cut_off(const glm::dvec3 &centre) const;
    void draw_point(std::size_t index, const glm::vec3 &image);
    void draw_point_around_eye(std::size_t index, const glm::vec3 &image);
    void draw_ellipse(std::size_t index, const SplatShape &shape, glm::vec2 pixel, float depth);
    void draw_pixel(std::size_t index, int x, int y, float depth);

    const Model &model_;
    const int level_;
    const DrawnLevel &drawn_;
    const PointView &points_;
    const std::span<const std::int8_t> offsets_;
    const Projection &projection_;
    const FrameGeometry frame_;
    const std::vector<ScreenNormal> normals_;
    const float voxel_; // edge
    Framebuffer &target_;
    std::array<std::size_t, kMaxDepth + 1> next_{}; // [level]: index of the next node
    std::uint64_t drawn_points_ = 0;
};

// Draws what lies below the next node of `level`. A depth-first walk meets the nodes of each level in their order, so
// one index per level suffices (BVG.md 4). `image` is M * centre: a child's is its parent's + M * step.
void PlainWalk::draw_node(int level, const glm::dvec3 &centre, const glm::vec3 &image) {
    const std::size_t node = next_[static_cast<std::size_t>(level)]++;
    if (level == level_) {
        if (is_hidden(points_.normals[node]) || is_cut_off(centre))
            return;
        draw_point(node, image);
        if (const auto second = drawn_.second(node))
            draw_point(*second, image);
        return;
    }
    const double d = std::ldexp(0.25, -level); // half the edge of a child
    for (unsigned mask = model_.levels[static_cast<std::size_t>(level) + 1].masks[node]; mask != 0; mask &= mask - 1) {
        const int child = std::countr_zero(mask);
        const glm::dvec3 step((child & 1) != 0 ? d : -d, (child & 2) != 0 ? d : -d, (child & 4) != 0 ? d : -d);
        draw_node(level + 1, centre + step, image + glm::vec3(projection_.vector(step)));
    }
}

// Whether a voxel's centre lies outside of the camera's clip region.
bool PlainWalk::is_cut_off(const glm::dvec3 &centre) const {
    const std::span<const HalfSpace> borders = projection_.clip.all();
    return std::any_of(borders.begin(), borders.end(),
                       [&](const HalfSpace &half) { return glm::dot(half.normal, centre) + half.offset < 0; });
}

// Draws a point that does not face away, as an ellipse. A back and the far side of a two-sided point have the opposite
// normal.
void PlainWalk::draw_point(std::size_t index, const glm::vec3 &image) {
    const float radius = radius_table()[points_.radii[index]], depth = image.z;
    if (depth <= kMinRadii * radius + kMinVoxels * voxel_)
        return draw_point_around_eye(index, image);
    const glm::vec2 pixel(image.x / depth, image.y / depth);
    auto normal = static_cast<std::size_t>(points_.normals[index] & frame_.normal_mask);
    const bool two_sided = (points_.normals[index] & kTwoSidedBit) != 0;
    float facing = glm::dot(normals_[normal].plane, glm::vec3(pixel, 1)); // cosine of normal and ray
    const bool is_back = !two_sided && facing > kFacingSlack;
    if ((is_back && !projection_.shows_backs) || ((points_.normals[index] & kSideBit) != 0 && facing > kSideSlack))
        return;
    if (is_back || (two_sided && facing > 0)) {
        normal ^= kOppositeNormal;
        facing = -facing;
    }
    SplatSize size{radius, is_back ? -voxel_ : voxel_, two_sided};
    if (!offsets_.empty())
        size.offset = offset_of(offsets_[drawn_.origin(index)]);
    ++drawn_points_;
    draw_ellipse(index, project_splat(projection_, normals_[normal], pixel, facing, size), pixel, depth);
}

// Draws a point that may reach behind the eye, as a disc that the ray of each pixel is intersected with.
void PlainWalk::draw_point_around_eye(std::size_t index, const glm::vec3 &image) {
    std::optional<float> offset;
    if (!offsets_.empty())
        offset = offset_of(offsets_[drawn_.origin(index)]);
    drawn_points_ += draw_near({image, points_.normals[index], radius_table()[points_.radii[index]], offset,
                                static_cast<std::uint32_t>(index)},
                               voxel_, projection_.shows_backs, frame_, target_);
}

// Draws the pixels whose centres lie in the ellipse of a point at `pixel`; their depths are those of the splat's plane.
// An ellipse no wider than a pixel is the one that holds its middle.
void PlainWalk::draw_ellipse(std::size_t index, const SplatShape &shape, glm::vec2 pixel, float depth) {
    const float scale = 1 / depth, radius = radius_table()[points_.radii[index]];
    const glm::vec2 middle = pixel + scale * shape.shift, size(target_.width, target_.height);
    const auto plane_depth = [&](glm::vec2 from_middle) {
        return depth * glm::dot(shape.slope, from_middle) + (shape.depth_shift + depth);
    };
    if (scale < 0.5F / (static_cast<float>(projection_.focal) * radius)) {
        if (middle.x < 0 || middle.y < 0 || middle.x >= size.x || middle.y >= size.y)
            return;
        const glm::ivec2 at(middle);
        return draw_pixel(index, at.x, at.y, plane_depth(glm::vec2(at) + 0.5F - middle));
    }
    const auto in_picture = [&](glm::vec2 at) { return glm::ivec2(glm::min(glm::max(glm::vec2(0), at), size)); };
    const glm::ivec2 first = in_picture(pixel + scale * (shape.shift - shape.reach) + 0.5F),
                     end = in_picture(pixel + scale * (shape.shift + shape.reach) + 0.5F);
    // A placed splat is a cone: its outline lies behind its plane.
    const float outline = scale * scale, cone = offsets_.empty() ? 0 : kPlacedCone * voxel_ / outline;
    for (int y = first.y; y < end.y; ++y)
        for (int x = first.x; x < end.x; ++x) {
            const glm::vec2 d = glm::vec2(x, y) + 0.5F - middle;
            const float form = d.x * (shape.xx * d.x + shape.xy * d.y) + shape.yy * d.y * d.y;
            if (form <= outline)
                draw_pixel(index, x, y, plane_depth(d) + cone * form);
        }
}

// The depth test.
void PlainWalk::draw_pixel(std::size_t index, int x, int y, float depth) {
    const auto at = static_cast<std::size_t>(std::ptrdiff_t{y} * target_.width + x);
    if (depth < target_.depth[at]) {
        target_.depth[at] = depth;
        target_.colour[at] = static_cast<std::uint32_t>(index);
    }
}

} // namespace

void ReferenceRenderer::set_offsets(int level, std::vector<std::int8_t> offsets) {
    const auto at = static_cast<std::size_t>(level);
    assert(offsets.empty() || offsets.size() == model_.levels[at].points.size());
    offsets_[at] = std::move(offsets);
}

RenderStatistics ReferenceRenderer::render(const Camera &camera, const RenderOptions &options, Framebuffer &target,
                                           int level) const {
    level = std::clamp(level, 0, static_cast<int>(model_.levels.size()) - 1);
    const auto edge = static_cast<float>(model_.parameters.grid.edge());
    const Projection projection(in_unit_grid(camera, model_.parameters), target.width, target.height);
    const Appearance appearance = appearance_in_frame(model_.parameters, options, projection.axes, appearance_);
    const auto surroundings = surroundings_ ? surroundings_->in_frame(appearance, projection, options) : nullptr;

    clear(options, target);
    const DrawnLevel points(model_, level);
    PlainWalk walk(model_, level, points, offsets_[static_cast<std::size_t>(level)], projection, target);
    const std::uint64_t drawn = walk.draw_all();

    const PointShader point_shader(model_.parameters, appearance, projection, surroundings.get(), options, true);
    const LevelShader shader(model_, level, points, appearance, point_shader);
    for (std::size_t at = 0; at < target.pixels(); ++at)
        if (target.depth[at] < std::numeric_limits<float>::infinity()) {
            target.colour[at] = shader.shade(target.colour[at], target.centre(at), target.depth[at]);
            target.depth[at] *= edge; // to model units
        }
    if (surroundings)
        surroundings->draw_behind(target, edge);
    return {level, model_.levels[static_cast<std::size_t>(level)].points.size(), drawn};
}

} // namespace pbm
