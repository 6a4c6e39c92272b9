#include "pbm_render/surroundings/ground_sampler.h"

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/surroundings/panorama_sampler.h"
#include "pbm_render/surroundings/surroundings.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

constexpr std::uint8_t kMissingValue = 255; // lit

// From model axes to u, v and up: the axes that follow the up axis in the cycle x, y, z, and it.
glm::dmat3 plane_axes(UpAxis up) {
    const int h = up == UpAxis::x ? 0 : up == UpAxis::y ? 1 : 2;
    glm::dmat3 rows(0);
    rows[0][(h + 1) % 3] = 1;
    rows[1][(h + 2) % 3] = 1;
    rows[2][h] = 1;
    return glm::transpose(rows);
}

glm::vec3 vector(const std::array<float, 3> &v) { return {v[0], v[1], v[2]}; }

glm::vec3 linear(Rgb8 srgb) {
    const auto one = [](std::uint8_t c) { return static_cast<float>(linear_table()[c]) / 65535.0F; };
    return {one(srgb[0]), one(srgb[1]), one(srgb[2])};
}

} // namespace

GroundSampler::GroundSampler(const ModelParameters &parameters, const TiledImages &images)
    : parameters_(parameters), plane_(*parameters.ground) {
    if (images.ground_texture && plane_.texture)
        texture_ = std::make_unique<TexelLevels>(std::vector{images.ground_texture}, kMissingValue / 2);
    std::vector<std::shared_ptr<const TiledImage>> word;
    for (const auto &image : images.ground_lit) {
        if (!word.empty() && (word.size() == 4 || image->width() != word.front()->width())) {
            lit_.push_back(std::make_unique<TexelLevels>(word, kMissingValue));
            word.clear();
        }
        lit_places_.push_back({static_cast<int>(lit_.size()), static_cast<int>(word.size())});
        word.push_back(image);
    }
    if (!word.empty())
        lit_.push_back(std::make_unique<TexelLevels>(word, kMissingValue));
}

void GroundSampler::retry() const {
    if (texture_)
        texture_->retry();
    for (const auto &word : lit_)
        word->retry();
}

GroundFrame GroundSampler::frame(const Appearance &appearance, const Projection &projection, bool shadows,
                                 bool texture) const {
    GroundFrame frame;
    const double grid_edge = parameters_.grid.edge();
    const double edge = 2.0 * static_cast<double>(plane_.half_edge) / grid_edge; // grid edges
    const glm::dmat3 turn = plane_axes(parameters_.grid.up);
    const glm::dvec3 corner = turn * glm::dvec3(vector(plane_.centre)) / grid_edge - glm::dvec3(edge / 2, edge / 2, 0);
    const auto place = [&](glm::dvec3 in_grid) { return (turn * in_grid - corner) / edge; };
    frame.axes = turn / edge;
    const glm::dvec3 eye = place(projection.eye);
    frame.eye = eye;
    frame.is_seen = eye.z > 0;

    // A side is where the ray's dot product with one vector changes its sign: a line on the screen.
    const std::array<glm::dvec3, 5> sides{glm::dvec3(eye.z, 0, -eye.x), glm::dvec3(-eye.z, 0, eye.x - 1),
                                          glm::dvec3(0, eye.z, -eye.y), glm::dvec3(0, -eye.z, eye.y - 1),
                                          glm::dvec3(0, 0, -1)};
    const glm::dvec3 origin = frame.axes * projection.ray({0, 0});
    const glm::dvec3 right = frame.axes * projection.ray({1, 0}) - origin;
    const glm::dvec3 down = frame.axes * projection.ray({0, 1}) - origin;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        const glm::dvec3 line(glm::dot(sides[i], right), glm::dot(sides[i], down), glm::dot(sides[i], origin));
        frame.lines[i] = line / std::max(std::hypot(line.x, line.y), 1e-9 * std::abs(line.z) + 1e-300);
    }

    frame.material = appearance.materials[std::min<std::size_t>(plane_.material, appearance.materials.size() - 1)];
    frame.has_texture = texture && texture_ != nullptr;
    frame.colour = linear(frame.material.colour);
    for (std::size_t i = 0; i < frame.palette.size(); ++i)
        frame.palette[i] = pack_roots(appearance.ground_palette[std::min<std::size_t>(i, 255)]);
    const auto word_of = [&](const TexelLevels &levels) {
        const auto found = std::find(frame.lit.begin(), frame.lit.end(), &levels);
        const auto word = static_cast<int>(found - frame.lit.begin());
        if (found == frame.lit.end())
            frame.lit.push_back(&levels);
        return word;
    };
    for (std::size_t i = 0; i < std::min<std::size_t>(appearance.lights.size(), kMaxLights); ++i) {
        const Light &light = appearance.lights[i];
        const bool far = light.kind == LightKind::directional;
        const ShadowSource &source = appearance.shadows[i];
        int word = -1, byte = -1;
        if (shadows && source.of_file && i < lit_places_.size()) {
            word = word_of(*lit_[static_cast<std::size_t>(lit_places_[i][0])]);
            byte = lit_places_[i][1];
        } else if (shadows && !source.of_file && source.fresh && source.fresh->ground) {
            word = word_of(*source.fresh->ground);
            byte = 0;
        }
        GroundLight &to = frame.lights[frame.light_count];
        to = {.kind = light.kind,
              .colour = vector(light.intensity),
              .place = far ? -glm::vec3(turn * glm::dvec3(vector(light.direction)))
                           : glm::vec3(place(glm::dvec3(vector(light.position)) / grid_edge)),
              .direction = glm::vec3(turn * glm::dvec3(vector(light.direction))),
              .exponent = light.exponent,
              .word = word,
              .byte = byte};
        if (to.place.z > 0) // else it shines from below
            ++frame.light_count;
    }
    return frame;
}

GroundRow GroundSampler::row(const GroundFrame &frame, const Projection &projection, glm::dvec2 first,
                             std::size_t count) {
    GroundRow row;
    const glm::dvec3 ray = projection.ray(first);
    row.first = frame.axes * ray;
    row.step = frame.axes * (projection.ray(first + glm::dvec2(1, 0)) - ray);
    row.down = frame.axes * (projection.ray(first + glm::dvec2(0, 1)) - ray);
    double begin = 0, end = static_cast<double>(count);
    for (std::size_t i = 0; i < frame.lines.size(); ++i) {
        const glm::dvec3 &line = frame.lines[i];
        const double at_first = glm::dot(line, glm::dvec3(first, 1));
        row.lines[i] = glm::vec2(at_first, line.x);
        const double outside = -0.5 - at_first; // line.x * x > outside
        if (line.x > 1e-9)
            begin = std::max(begin, std::floor(outside / line.x));
        else if (line.x < -1e-9)
            end = std::min(end, std::ceil(outside / line.x) + 1);
        else if (outside >= 1e-3)
            end = 0;
    }
    row.begin = static_cast<std::size_t>(std::clamp(begin, 0.0, static_cast<double>(count)));
    row.end = static_cast<std::size_t>(std::clamp(end, 0.0, static_cast<double>(count)));
    if (!frame.is_seen || row.begin > row.end)
        row.end = row.begin = 0;
    return row;
}

} // namespace pbm
