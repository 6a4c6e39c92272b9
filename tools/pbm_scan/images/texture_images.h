// The images of a surface while a reader builds its triangles.
#pragma once

#include "pbm_scan/conventions/reflectance.h"
#include "pbm_scan/surface/surface.h"
#include "system/bytes.h"

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace pbm::build {

// An image that is the opacity of another one.
struct OpacityFile {
    std::string path;
    bool is_inverted = false; // its white is transparent
};

// An image of several that say together how a material reflects.
struct ReflectanceImage {
    std::string name; // identifies the image
    ReflectancePart part{};
    std::array<float, 3> colour{1, 1, 1}; // of `specular_colour`: linear factors, 0..1
    std::function<Result<Texture>()> read;
};

// Reads each image once, when it is first used. One that cannot be read is reported as dropped, and has the number
// Surface::kNoTexture.
class TextureImages {
  public:
    // `report` gets a line for each image.
    TextureImages(Surface &surface, std::vector<AttributeReport> &report) : surface_(surface), report_(report) {}

    // The number of the image of a file in Surface::textures.
    std::uint16_t of_file(const std::string &path, const TextureUse &use);
    // The same of an image whose opacity has a file of its own: that is the opacity of the second image, or its
    // brightness if it is opaque. The result is as large as the larger of both. An empty `path` is one texel of
    // `colour`. Where the second one cannot be read, or says nothing that the first does not, the image cuts no holes.
    std::uint16_t of_files(const std::string &path, const Rgb8 &colour, const OpacityFile &opacity,
                           const TextureUse &use);
    // The same of how a material reflects, from images that lie alike; the result is as large as the largest of them.
    // `use`: with the factors of all. `plain`: factor of specular, roughness and metal where no image says otherwise.
    // Images that cannot be read are left out.
    std::uint16_t of_reflectance(std::span<const ReflectanceImage> images, TextureUse use,
                                 const ReflectanceTexel &plain = {255, 255, 255});
    // The same of one white texel, which the report does not name: of factors alone.
    std::uint16_t of_texel(const TextureUse &use);
    // The same of bytes in memory; `name` identifies them.
    std::uint16_t of_bytes(const std::string &name, ByteView bytes, const TextureUse &use);

  private:
    // Decoded bytes of all images together.
    static constexpr std::uint64_t kMaxBytes = std::uint64_t{8} << 30;

    using Key = std::pair<std::string, TextureUse>;
    std::uint16_t add(Key key, ByteView bytes);
    std::uint16_t add(Key key, Texture texture);
    // The same without a line in the report.
    std::uint16_t keep(Key key, Texture texture);
    std::uint16_t drop(const Key &key, const std::string &why);

    Surface &surface_;
    std::vector<AttributeReport> &report_;
    std::map<Key, std::uint16_t> numbers_;
    std::uint64_t bytes_ = 0;
};

// Says how a triangle of `surface` is coloured. Call it for each triangle in their order. Corners far outside of the
// image, or not finite, are moved to its corner.
void set_texture(Surface &surface, std::size_t triangle, std::uint16_t texture, const TextureCorners &corners);
// The same of another layer.
void set_texture(Surface &surface, Layer layer, std::size_t triangle, std::uint16_t texture,
                 const TextureCorners &corners);

// A line of the texture coordinates: what became of them.
void report_textures(Surface &surface);

} // namespace pbm::build
