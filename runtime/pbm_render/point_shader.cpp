#include "pbm_render/point_shader.h"

#include "pbm_render/normal_table.h"

#include <glm/geometric.hpp>

#include <cmath>

namespace pbm {
namespace {

// More tables of shaded normals would take longer than what they save.
constexpr std::size_t kFewMaterials = 2;

} // namespace

PointShader::PointShader(const ModelParameters &parameters, std::span<const Light> lights, const Projection &projection,
                         bool point_colours)
    : parameters_(parameters), lights_(lights), projection_(projection),
      colour_(point_colours ? parameters.attributes.colour : ColourFormat::none),
      shadowed_(static_cast<std::size_t>(parameters.attributes.lights)), normals_(splat_normals()),
      first_ray_(projection.ray({0, 0})), ray_right_(projection.ray({1, 0}) - projection.ray({0, 0})),
      ray_down_(projection.ray({0, 1}) - projection.ray({0, 0})),
      table_(parameters.materials, lights, parameters.attributes.lights, -projection.axes.forward) {
    for (std::size_t i = 0; i < parameters.materials.size(); ++i)
        material_colours_[i] = colours_.linear(pack_rgb(parameters.materials[i].colour));
    for (const Light &light : lights)
        positional_ |= light.kind != LightKind::directional;
    if (colour_ != ColourFormat::none || shadowed_ > 0 || positional_ || parameters.materials.size() > kFewMaterials)
        return;
    shaded_normals_.reserve(parameters.materials.size() * kNormalCount);
    for (std::size_t material = 0; material < parameters.materials.size(); ++material)
        for (std::size_t normal = 0; normal < kNormalCount; ++normal)
            shaded_normals_.push_back(
                colours_.pack_srgb(material_colours_[material] * table_.unshadowed(material, normal)));
}

// The normal of a two-sided point, turned towards the eye.
std::size_t PointShader::side_seen(std::size_t normal, glm::vec2 pixel) const {
    const SplatNormal &n = normals_[normal];
    const glm::vec3 ray = first_ray_ + pixel.x * ray_right_ + pixel.y * ray_down_;
    const bool away = n.x * ray.x + n.y * ray.y + n.z * ray.z > 0;
    return away ? normal ^ kOppositeNormal : normal;
}

// Point and spot lights depend on the place: not in the table. Light does not weaken with distance.
Float4 PointShader::reflect(const Light &light, std::size_t material, std::size_t normal, glm::vec2 pixel,
                            float depth) const {
    const glm::dvec3 from_eye = projection_.ray(pixel) * static_cast<double>(depth);
    const glm::vec3 to_eye = glm::normalize(-from_eye);
    const glm::dvec3 position =
        glm::dvec3(light.position[0], light.position[1], light.position[2]) / parameters_.grid.edge();
    const glm::vec3 to_light = glm::normalize(position - (projection_.eye + from_eye));
    const UnitVector &n = normal_table()[normal];
    glm::vec3 term = phong(parameters_.materials[material], light, glm::vec3(n[0], n[1], n[2]), to_light, to_eye);
    if (light.kind == LightKind::spot) {
        const float cosine = -glm::dot(to_light, glm::vec3(light.direction[0], light.direction[1], light.direction[2]));
        term *= cosine > 0 ? std::pow(cosine, light.exponent) : 0.0F;
    }
    return Float4{term.r, term.g, term.b, 0};
}

} // namespace pbm
