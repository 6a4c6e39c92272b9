#include "pbm_render/fine/surface_points.h"

#include <algorithm>

namespace pbm {

SurfacePoints::SurfacePoints(const ModelParameters &parameters, const Appearance &appearance,
                             const RenderOptions &options, bool mirrors)
    : colour_(options.point_colours ? parameters.attributes.colour : ColourFormat::none),
      indices_(options.texture && palette_stream(parameters.attributes)
                   ? PointView::column(palette_stream(parameters.attributes)->kind)
                   : nullptr),
      has_phong_(appearance.materials.size() > 1),
      tints_(mirrors && std::any_of(appearance.materials.begin(), appearance.materials.end(), is_tinted)),
      shadowed_(options.shadows
                    ? std::min(static_cast<std::size_t>(parameters.attributes.lights), appearance.lights.size())
                    : 0),
      last_material_(appearance.materials.size() - 1), set_(parameters.attributes), shadows_(appearance.shadows) {
    for (std::size_t i = 0; i < linear_.size(); ++i)
        linear_[i] = static_cast<float>(linear_table()[i]) / 65535.0F;
    const auto linear = [&](Rgb8 c) { return Float4{linear_[c[0]], linear_[c[1]], linear_[c[2]], 0}; };
    for (std::size_t i = 0; i < palette_.size(); ++i)
        palette_[i] = linear(appearance.palette[i]);
    for (std::size_t i = 0; i < appearance.materials.size(); ++i) {
        const Material &m = appearance.materials[i];
        material_colours_[i] = linear(m.colour);
        phong_[i] = Float4{m.ka, m.kd, m.ks, m.power};
        environment_[i] = options.reflections ? m.environment : 0;
        tint_[i] = environment_[i] * static_cast<float>(m.tint) / 255;
    }
}

void SurfacePoints::read_more(const PointRun &run, std::size_t i, std::size_t material, SurfacePoint &to) const {
    float *const channels = to.channels.data();
    if (has_phong_)
        for (std::size_t k = 0; k < 4; ++k)
            channels[channel::kPhong + k] = phong_[material][static_cast<int>(k)];
    if (tints_)
        channels[channel::kTint] = tint_[material];
    for (std::size_t light = 0; light < shadowed_; ++light) {
        const float lit = shadow_stream(run, light, set_, shadows_[light]).lit(i);
        const bool is_flag = set_.shadow_bits[light][static_cast<std::size_t>(run.level)] == 1;
        channels[channel::kLit + light] = is_flag ? (lit - 0.5F) * kFlagContrast + 0.5F : lit;
    }
}

} // namespace pbm
