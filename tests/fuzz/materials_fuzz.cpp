// Whatever a surface shows, it gets materials that a model can hold, a number of one of them for each vertex and each
// cell, and the same ones with any number of threads.
#include "fuzz/byte_source.h"
#include "fuzz/surface_law.h"
#include "pbm_build/images/reflectance_materials.h"
#include "pbm_build/images/surface_looks.h"

#include <algorithm>

namespace {

using namespace pbm;
using namespace pbm::build;

Texture image_of(test::ByteSource &source, ImageContent content) {
    Texture image{.width = 1 + static_cast<std::uint32_t>(source.below(4)),
                  .height = 1 + static_cast<std::uint32_t>(source.below(4)),
                  .texels = {},
                  .use = {.wrap = {static_cast<Wrap>(source.below(3)), static_cast<Wrap>(source.below(3))},
                          .is_tinted = source.below(2) != 0,
                          .content = content}};
    for (std::uint32_t i = 0; i < image.width * image.height; ++i)
        image.texels.push_back({source.next(), source.next(), source.next(), source.next()});
    return image;
}

// Texture coordinates as set_texture leaves them: any number below a million.
glm::vec2 place_of(test::ByteSource &source) {
    constexpr std::array<float, 8> kPlaces{0, 1, 0.5F, -0.25F, 3.75F, 999999, -999999, 1e-30F};
    return {kPlaces[source.below(kPlaces.size())], kPlaces[source.below(kPlaces.size())]};
}

void set_image(test::ByteSource &source, std::size_t images, std::uint16_t &id, TextureCorners &corners) {
    const std::size_t number = source.below(images + 1);
    id = number == images ? Surface::kNoTexture : static_cast<std::uint16_t>(number);
    for (glm::vec2 &corner : corners)
        corner = place_of(source);
}

Surface surface_of(test::ByteSource &source) {
    Surface surface;
    const std::size_t count = 3 + source.below(12);
    constexpr std::array<double, 6> kNumbers{0, 1, -1, 1e-200, 1e200, 0.1};
    for (std::size_t i = 0; i < count; ++i)
        surface.positions.push_back({kNumbers[source.below(6)], kNumbers[source.below(6)], kNumbers[source.below(6)]});
    for (std::size_t faces = 1 + source.below(8); faces > 0; --faces) {
        const auto first = static_cast<std::uint32_t>(source.below(count - 2));
        surface.triangles.push_back({first, first + 1, first + 2});
    }
    const std::size_t materials = source.below(kMaxMaterials + 1);
    for (std::size_t i = 0; i < materials; ++i) {
        surface.materials.push_back({.ka = static_cast<float>(i) / 8});
        surface.reflectances.emplace_back();
        if (source.below(2) != 0)
            surface.reflectances.back() =
                Reflectance{source.next() / 255.0, source.next() / 255.0, 1, source.below(2) != 0};
    }
    if (materials > 1)
        for (std::size_t i = 0; i < count; ++i)
            surface.material_ids.push_back(static_cast<std::uint8_t>(source.below(materials)));
    if (source.below(2) != 0)
        for (std::size_t i = 0; i < count; ++i)
            surface.colours.push_back({source.next(), source.next(), source.next()});
    constexpr std::array kContents{ImageContent::colours, ImageContent::reflectance, ImageContent::emission,
                                   ImageContent::darkness};
    const std::size_t images = 1 + source.below(6);
    for (std::size_t i = 0; i < images; ++i)
        surface.textures.push_back(image_of(source, kContents[source.below(kContents.size())]));
    const std::size_t faces = surface.triangles.size();
    if (source.below(2) != 0) {
        surface.texture_ids.resize(faces);
        surface.texture_corners.resize(faces);
        for (std::size_t i = 0; i < faces; ++i)
            set_image(source, images, surface.texture_ids[i], surface.texture_corners[i]);
    }
    for (ImageLayer &layer : surface.layers)
        if (source.below(4) != 0) {
            layer.ids.resize(faces);
            layer.corners.resize(faces);
            for (std::size_t i = 0; i < faces; ++i)
                set_image(source, images, layer.ids[i], layer.corners[i]);
        }
    return surface;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size == 0)
        return 0;
    test::ByteSource source({data, size});
    const std::size_t max_materials = 2 + source.below(kMaxMaterials - 1);
    Surface surface = surface_of(source), other = surface;
    BuildStatistics said;
    choose_reflectances(surface, {}, max_materials, 1, said);
    choose_reflectances(other, {}, max_materials, 2, said);
    test::require(surface.materials == other.materials && surface.material_ids == other.material_ids &&
                  surface.material_of_cell == other.material_of_cell);
    test::require(surface.reflectances.empty() || surface.layer(Layer::reflectance).ids.empty());
    const std::size_t cells = surface.material_of_cell.size();
    test::require(cells == 0 || cells == kReflectanceCells || cells == kLookCells);
    if (cells != 0)
        test::require(surface.materials.size() <= max_materials);
    for (const Material &material : surface.materials)
        for (const float coefficient : {material.ka, material.kd, material.ks, material.environment})
            test::require(coefficient >= 0 && coefficient <= 1);
    const auto is_one = [&](std::uint8_t id) { return id < surface.materials.size(); };
    test::require(std::all_of(surface.material_ids.begin(), surface.material_ids.end(), is_one));
    test::require(std::all_of(surface.material_of_cell.begin(), surface.material_of_cell.end(), is_one));
    return 0;
}
