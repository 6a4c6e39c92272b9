#include "pbm_render/appearance/shade_table.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {

glm::vec3 phong(const Material &material, const Light &light, glm::vec3 normal, glm::vec3 to_light, glm::vec3 to_eye) {
    const float diffuse = glm::dot(normal, to_light);
    if (diffuse <= 0)
        return glm::vec3(0);
    const float mirrored = glm::dot(2 * diffuse * normal - to_light, to_eye);
    const float specular = mirrored > 0 ? std::pow(mirrored, material.power) : 0.0F;
    return (material.kd * diffuse + material.ks * specular) *
           glm::vec3(light.intensity[0], light.intensity[1], light.intensity[2]);
}

ShadeTable::ShadeTable(std::span<const Material> materials, std::span<const Light> lights, int shadowed_lights,
                       glm::vec3 to_eye)
    : materials_(materials.size()), unshadowed_(materials.size() * kNormalCount),
      shadowed_(static_cast<std::size_t>(shadowed_lights) * materials.size() * kNormalCount) {
    const std::span<const UnitVector> directions = normal_table();
    for (std::size_t m = 0; m < materials.size(); ++m) {
        for (std::size_t i = 0; i < kNormalCount; ++i) {
            const UnitVector &n = directions[i];
            const glm::vec3 normal(n[0], n[1], n[2]);
            Float4 sum = Float4{} + materials[m].ka;
            for (std::size_t l = 0; l < lights.size(); ++l) {
                if (lights[l].kind != LightKind::directional)
                    continue;
                const auto &d = lights[l].direction;
                const glm::vec3 added = phong(materials[m], lights[l], normal, -glm::vec3(d[0], d[1], d[2]), to_eye);
                const Float4 term{added.r, added.g, added.b, 0};
                if (l < static_cast<std::size_t>(shadowed_lights))
                    shadowed_[(l * materials_ + m) * kNormalCount + i] = term;
                else
                    sum += term;
            }
            unshadowed_[m * kNormalCount + i] = sum;
        }
    }
}

ColourTable::ColourTable() {
    for (std::size_t i = 0; i < linear_.size(); ++i)
        linear_[i] = static_cast<float>(linear_table()[i]) / 65535.0F;
    for (std::size_t i = 0; i <= static_cast<std::size_t>(kSteps); ++i)
        srgb_[i] = linear_to_srgb(static_cast<std::uint32_t>(std::lround(65535.0 * static_cast<double>(i) / 4095.0)));
}

} // namespace pbm
