// Materials of glTF, and the images of their colours.
#pragma once

#include "pbm_scan/gltf/gltf_document.h"
#include "pbm_scan/images/texture_images.h"
#include "pbm_scan/surface/surface.h"

#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pbm::build {

// An image of a material, and where it lies.
struct GltfImage {
    std::uint16_t texture = Surface::kNoTexture; // it may be that it cannot be read
    std::string coordinates = "TEXCOORD_0";
    std::array<Wrap, 2> wrap{}; // to the right, downwards
    glm::mat3 transform{1};     // of the texture coordinates
    bool is_uniform = false;    // one texel, which lies everywhere

    bool lies_as(const GltfImage &other) const {
        return coordinates == other.coordinates && wrap == other.wrap && transform == other.transform;
    }
};

struct GltfMaterial {
    Material material;                        // its colour is that of `factor`
    std::optional<Reflectance> reflectance{}; // that `material` has; absent: other coefficients
    glm::vec4 factor{1};                      // linear
    float cutoff = 0;                         // opacities below it are no surface, where alphaMode is MASK; 0: all are
    bool is_cut = false;                      // alphaMode is MASK or BLEND
    bool has_image = false;                   // of the base colour; it may turn out that it cannot be read
    GltfImage image;                          // of the base colour
    std::array<GltfImage, kLayers> layers;
    std::uint16_t plain_reflectance = Surface::kNoTexture; // of its factors; of materials with emission or occlusion

    // Calls `visit` for each image that can be read and has a place.
    template <class Visit> void for_images(const Visit &visit) const {
        if (image.texture != Surface::kNoTexture)
            visit(image);
        for (const GltfImage &of_layer : layers)
            if (of_layer.texture != Surface::kNoTexture && !of_layer.is_uniform)
                visit(of_layer);
    }
    bool has_image_of(Layer layer) const {
        return layers[static_cast<std::size_t>(layer)].texture != Surface::kNoTexture;
    }
};

class GltfMaterials {
  public:
    // Images are added to `surface`; `report` gets a line for each image and for what is dropped.
    GltfMaterials(GltfDocument &document, const ReadOptions &options, Surface &surface,
                  std::vector<AttributeReport> &report);

    // The material of this number; absent: the default one.
    const GltfMaterial &get(std::optional<std::size_t> index);
    // The number of an image that holds nothing but the opacity of this material.
    std::uint16_t plain_image(const GltfMaterial &material);

  private:
    void read_colour_image(const Json &texture, GltfMaterial &material);
    void read_reflectance(const Json &described, GltfMaterial &material);
    void read_emission(const Json &described, GltfMaterial &material);
    void read_occlusion(const Json &described, GltfMaterial &material);
    void complete_reflectance(GltfMaterial &material);
    void read_normal_map(const Json &texture, GltfMaterial &material);
    void read_reflectance_images(const Json *roughness_metal, const Json *specular, const Reflectance &factors,
                                 GltfMaterial &material);
    void add_reflectance_image(const Json &used, const char *name, ReflectancePart part, GltfImage &place,
                               std::vector<ReflectanceImage> &images);
    // Says where the image of a texture lies, and returns its number. Nothing: it names none.
    std::optional<std::size_t> find_image(const Json &used, GltfImage &image);
    // Loads it too; `use` describes it but for its wrapping. False: it names none.
    bool read_image(const Json &used, const TextureUse &use, GltfImage &image);
    // The same of an image in a layer, if there is a texture; `name`: of the texture, for the report.
    void read_layer(Layer layer, const Json *texture, const char *name, const TextureUse &use, GltfMaterial &material);
    std::uint16_t load_image(std::size_t image, const TextureUse &use);
    std::string name_of(std::size_t image) const;
    // `resource` holds bytes that the document does not.
    Result<ByteView> bytes_of(std::size_t image, GltfResource &resource);

    GltfDocument &document_;
    const ReadOptions &options_;
    TextureImages images_;
    std::vector<AttributeReport> &report_;
    std::map<std::optional<std::size_t>, GltfMaterial> known_; // by index; nothing: of primitives that name none
    float white_ = 1; // in factors of colours; more where the file counts in bytes
    bool has_unlit_ = false, has_double_sided_ = false;
};

} // namespace pbm::build
