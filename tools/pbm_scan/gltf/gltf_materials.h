// Materials of glTF, and the images of their colours.
#pragma once

#include "pbm_scan/gltf/gltf_document.h"
#include "pbm_scan/images/texture_images.h"
#include "pbm_scan/surface/surface.h"

#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pbm::build {

struct GltfMaterial {
    Material material;      // its colour is that of `factor`
    glm::vec4 factor{1};    // linear
    float cutoff = 0;       // opacities below it are no surface, where alphaMode is MASK; 0: all are
    bool is_cut = false;    // alphaMode is MASK or BLEND
    bool has_image = false; // of the base colour; it may turn out that it cannot be read
    std::uint16_t texture = Surface::kNoTexture;
    std::string coordinates = "TEXCOORD_0";
    glm::mat3 transform{1}; // of the texture coordinates
};

class GltfMaterials {
  public:
    // Images are added to `surface`; `report` gets a line for each image and for what is dropped.
    GltfMaterials(GltfDocument &document, const Material &default_material, Surface &surface,
                  std::vector<AttributeReport> &report);

    // The material of this number; absent: the default one.
    const GltfMaterial &get(std::optional<std::size_t> index);
    // The number of an image that holds nothing but the opacity of this material.
    std::uint16_t plain_image(const GltfMaterial &material);

  private:
    void read_image(const Json &texture, GltfMaterial &material);
    std::uint16_t load_image(std::size_t image, const TextureUse &use);

    GltfDocument &document_;
    const Material &default_material_;
    TextureImages images_;
    std::vector<AttributeReport> &report_;
    std::map<std::size_t, GltfMaterial> known_;
    float white_ = 1; // in factors of colours; more where the file counts in bytes
    bool has_unlit_ = false, has_double_sided_ = false;
};

} // namespace pbm::build
