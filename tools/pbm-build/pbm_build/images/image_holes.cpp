#include "pbm_build/images/image_holes.h"

#include "pbm_build/images/texture_pyramid.h"
#include "pbm_scan/surface/refusal.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

namespace pbm::build {
namespace {

struct ShownTexels {
    bool has_clear = false; // some are less opaque than glass
    bool has_holes = false; // some are less opaque than the limit
    bool has_rest = false;  // some are not
    bool is_opaque = true;  // all are
};

ShownTexels shown_texels(const Texture &texture, const TextureCoverage &coverage) {
    constexpr float kGlass = 255 / 8.0F;
    ShownTexels shown;
    for (std::size_t i = 0; i < texture.texels.size(); ++i)
        if (coverage.covers(i)) {
            const float opacity = static_cast<float>(texture.texels[i][3]) * texture.use.opacity;
            (texture.use.is_hole(texture.texels[i][3]) ? shown.has_holes : shown.has_rest) = true;
            shown.has_clear = shown.has_clear || opacity < kGlass;
            shown.is_opaque = shown.is_opaque && opacity >= 255;
        }
    return shown;
}

std::string short_number(float value) {
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "%.3g", static_cast<double>(value));
    return text.data();
}

void add_line(const std::string &name, std::size_t images, const std::string &note, Fate fate, const Surface &surface,
              BuildStatistics &statistics) {
    statistics.attributes.push_back(
        {name, fate, (images == 1 ? "1 image: " : std::to_string(images) + " images: ") + note, surface.name});
}

} // namespace

Status settle_holes(Surface &surface, const HoleRequest &request, int threads, BuildStatistics &statistics) {
    for (Texture &texture : surface.textures)
        if (request.alpha_cutoff && texture.use.content == ImageContent::colours) {
            texture.use.is_blended = texture.use.is_blended || texture.use.least_opacity == 0;
            texture.use.least_opacity = static_cast<float>(*request.alpha_cutoff);
        }
    const bool cuts = std::any_of(surface.textures.begin(), surface.textures.end(),
                                  [](const Texture &texture) { return texture.use.least_opacity > 0; });
    if (!cuts)
        return {};
    const std::vector<TextureCoverage> coverages = covered_texels(surface, threads);
    std::size_t with_holes = 0, of_glass = 0;
    float least = 0;
    for (std::size_t i = 0; i < surface.textures.size(); ++i) {
        TextureUse &use = surface.textures[i].use;
        if (use.least_opacity == 0)
            continue;
        use.is_faded = !surface.transparencies.empty();
        const ShownTexels shown = shown_texels(surface.textures[i], coverages[i]);
        const bool is_cut = shown.has_holes && shown.has_rest && (shown.has_clear || request.alpha_cutoff);
        if (use.is_blended && !is_cut) {
            of_glass += shown.is_opaque ? 0U : 1U;
            use.least_opacity = 0;
            continue;
        }
        with_holes += shown.has_holes || use.is_faded ? 1U : 0U;
        least = std::max(least, use.least_opacity);
    }
    if (with_holes != 0)
        add_line("transparent texels", with_holes, "no surface where the opacity is below " + short_number(least),
                 Fate::converted, surface, statistics);
    if (of_glass == 0)
        return {};
    constexpr const char *kGlass = "points are opaque: what is shown has no clear texels beside opaque ones, as glass";
    if (request.strict)
        return bad_input("--strict: opacity of images would be dropped (" + std::string(kGlass) +
                         "); remove it from the scan or leave --strict out");
    add_line("opacity of images", of_glass, kGlass, Fate::dropped, surface, statistics);
    return {};
}

} // namespace pbm::build
