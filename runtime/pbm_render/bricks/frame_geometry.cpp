#include "pbm_render/bricks/frame_geometry.h"

namespace pbm {

FrameGeometry::FrameGeometry(const Projection &p, int picture_width, int picture_height)
    : projection(p), width(picture_width), height(picture_height), focal(static_cast<float>(p.focal)),
      inverse_focal(1 / focal), middle_x(static_cast<float>(p.middle.x)), middle_y(static_cast<float>(p.middle.y)),
      normals(kNormalCount), packed(kNormalCount), radii(radius_table()), thickness(splat_thickness()),
      shows_backs(!p.clip.empty()) {
    const auto right = glm::vec3(p.axes.right), down = glm::vec3(-p.axes.up), forward = glm::vec3(p.axes.forward);
    const std::span<const SplatNormal> table = splat_normals();
    const auto pack = [](float value, int shift) { // nearest, of -256 .. 255
        return static_cast<std::uint32_t>(static_cast<std::int32_t>(value + 256.5F) - 256) << shift;
    };
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const SplatNormal &n = table[i];
        const EyeNormal eye{n.x * right.x + n.y * right.y + n.z * right.z, n.x * down.x + n.y * down.y + n.z * down.z,
                            n.x * forward.x + n.y * forward.y + n.z * forward.z, n.inset};
        normals[i] = eye;
        packed[i] = static_cast<std::int32_t>(
            pack(eye.x * kPackedNormalScale, 23) | (pack(eye.y * kPackedNormalScale, 14) & 0x7FC000) |
            (pack(eye.z * kPackedNormalScale, 5) & 0x3FE0) | pack(eye.inset * kPackedInsetScale / 2, 1));
    }
}

} // namespace pbm
