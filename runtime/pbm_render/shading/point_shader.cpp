#include "pbm_render/shading/point_shader.h"

#include "pbm_render/camera/normal_table.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

// With more materials, computing the table of shaded normals takes longer than it saves.
constexpr std::size_t kFewMaterials = 2;

// Radians: twice the angle between neighbouring normals, which a mirror doubles. Smaller details would flicker.
constexpr float kMirroredAngle = 0.08F;
// A point faces away, whatever the perspective, if the cosine between its normal and the view direction exceeds this.
constexpr float kFarAway = 0.7F;

int count_shadowed(const AttributeSet &set, const Appearance &appearance, const RenderOptions &options) {
    return options.shadows ? std::min(set.lights, static_cast<int>(appearance.lights.size())) : 0;
}

// Panorama light reflected towards an eye infinitely far away: [kNormalCount].
std::vector<Float4> mirror_panorama(const FrameSurroundings &surroundings, glm::vec3 forward) {
    std::vector<Float4> mirrored(kNormalCount);
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const UnitVector &n = normal_table()[i];
        const glm::vec3 normal(n[0], n[1], n[2]);
        if (const float away = glm::dot(normal, forward); away < kFarAway)
            mirrored[i] = surroundings.reflection(forward - 2 * away * normal, kMirroredAngle);
    }
    return mirrored;
}

} // namespace

PointShader::PointShader(const ModelParameters &parameters, const Appearance &appearance, const Projection &projection,
                         const FrameSurroundings *surroundings, const RenderOptions &options, bool shades)
    : parameters_(parameters), appearance_(appearance), projection_(projection),
      source_(pbm::colour_source(parameters.attributes, options)),
      point_colours_(source_ == ColourSource::material || source_ == ColourSource::texture
                         ? ColourFormat::none
                         : parameters.attributes.colour),
      shadowed_(static_cast<std::size_t>(count_shadowed(parameters.attributes, appearance, options))),
      normals_(splat_normals()), first_ray_(projection.ray({0, 0})),
      ray_right_(projection.ray({1, 0}) - projection.ray({0, 0})),
      ray_down_(projection.ray({0, 1}) - projection.ray({0, 0})) {
    bool mirrors = false;
    for (std::size_t i = 0; i < appearance.materials.size(); ++i) {
        material_colours_[i] = colours_.linear(pack_rgb(appearance.materials[i].colour));
        mirrors |= appearance.materials[i].environment > 0;
        tints_ |= is_tinted(appearance.materials[i]);
    }
    for (std::size_t i = 0; i < palette_.size(); ++i)
        palette_[i] = pack_rgb(appearance.palette[i]);
    for (std::size_t l = 0; l < appearance.lights.size(); ++l)
        if (appearance.lights[l].kind != LightKind::directional)
            positional_ = true;
        else if (l < shadowed_)
            shadowed_directional_.push_back(l);
    if (mirrors && surroundings != nullptr && surroundings->has_reflections())
        mirrored_ = mirror_panorama(*surroundings, projection.axes.forward);
    const bool has_shaded_normals = source_ == ColourSource::material && shadowed_ == 0 && !positional_ &&
                                    appearance.materials.size() <= kFewMaterials;
    if (has_shaded_normals || shades)
        table_.emplace(appearance.materials, appearance.lights, static_cast<int>(shadowed_), -projection.axes.forward);
    if (!has_shaded_normals)
        return;
    shaded_normals_.reserve(appearance.materials.size() * kNormalCount);
    for (std::size_t material = 0; material < appearance.materials.size(); ++material)
        for (std::size_t normal = 0; normal < kNormalCount; ++normal)
            shaded_normals_.push_back(colours_.pack_srgb(
                mirror(material_colours_[material], table_->unshadowed(material, normal), material, normal)));
}

// Blends the panorama over a lit colour, clamped to white, with the material's environment factor.
Float4 PointShader::mirror(Float4 colour, Float4 light, std::size_t material, std::size_t normal) const {
    const Float4 lit = colour * light;
    if (mirrored_.empty())
        return lit;
    constexpr Float4 kWhite{1, 1, 1, 1};
    const Float4 own = lit < kWhite ? lit : kWhite;
    const Float4 mirrored = tints_ ? tinted(mirrored_[normal], colour, material) : mirrored_[normal];
    return own + appearance_.materials[material].environment * (mirrored - own);
}

// Index of the normal, or of the opposite one if (normal . ray of depth 1) exceeds `beyond`.
std::size_t PointShader::visible_side(std::size_t normal, glm::vec2 pixel, float beyond) const {
    const SplatNormal &n = normals_[normal];
    const glm::vec3 ray = first_ray_ + pixel.x * ray_right_ + pixel.y * ray_down_;
    const bool away = n.x * ray.x + n.y * ray.y + n.z * ray.z > beyond;
    return away ? normal ^ kOppositeNormal : normal;
}

// Point and spot lights depend on the position and so are not in the table. They do not weaken with distance.
Float4 PointShader::reflect(const Light &light, std::size_t material, std::size_t normal, glm::vec2 pixel,
                            float depth) const {
    const glm::dvec3 from_eye = projection_.ray(pixel) * static_cast<double>(depth);
    const glm::vec3 to_eye = glm::normalize(-from_eye);
    const glm::dvec3 position =
        glm::dvec3(light.position[0], light.position[1], light.position[2]) / parameters_.grid.edge();
    const glm::vec3 to_light = glm::normalize(position - (projection_.eye + from_eye));
    const UnitVector &n = normal_table()[normal];
    glm::vec3 term = phong(appearance_.materials[material], light, glm::vec3(n[0], n[1], n[2]), to_light, to_eye);
    if (light.kind == LightKind::spot) {
        const float cosine = -glm::dot(to_light, glm::vec3(light.direction[0], light.direction[1], light.direction[2]));
        term *= cosine > 0 ? std::pow(cosine, light.exponent) : 0.0F;
    }
    return Float4{term.r, term.g, term.b, 0};
}

} // namespace pbm
