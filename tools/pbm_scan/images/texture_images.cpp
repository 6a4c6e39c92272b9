#include "pbm_scan/images/texture_images.h"

#include "pbm_scan/images/read_image.h"
#include "pbm_scan/text/printable.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pbm::build {
namespace {

std::string line_name(const std::string &path) {
    return "texture image " + printable_in_quotes(std::string_view(path).substr(path.find_last_of('/') + 1));
}

std::string orientation_note(std::uint8_t orientation) {
    return orientation == 1 ? "" : "; its orientation (" + std::to_string(orientation) + ") is not applied";
}

} // namespace

std::uint16_t TextureImages::of_file(const std::string &path, const TextureUse &use) {
    Key key{path, use};
    if (const auto known = numbers_.find(key); known != numbers_.end())
        return known->second;
    const Result<MappedFile> file = MappedFile::open(path);
    return file ? add(std::move(key), file->bytes()) : drop(key, file.error().message);
}

std::uint16_t TextureImages::of_bytes(const std::string &name, ByteView bytes, const TextureUse &use) {
    Key key{name, use};
    const auto known = numbers_.find(key);
    return known != numbers_.end() ? known->second : add(std::move(key), bytes);
}

std::uint16_t TextureImages::add(Key key, ByteView bytes) {
    if (surface_.textures.size() == Surface::kNoTexture)
        return drop(key, "more images than can be numbered");
    Result<Texture> texture = read_image(bytes);
    if (!texture)
        return drop(key, texture.error().message);
    bytes_ += 4 * texture->texels.size();
    if (bytes_ > kMaxBytes)
        return drop(key, "the images need more than 8 GiB; make them smaller");
    texture->use = key.second;
    report_.push_back({line_name(key.first), Fate::converted,
                       std::to_string(texture->width) + " x " + std::to_string(texture->height) +
                           ", to colours of points" +
                           (texture->has_stray_bytes ? "; bytes that belong to no part of the image left out" : "") +
                           orientation_note(texture->orientation)});
    surface_.textures.push_back(std::move(*texture));
    const auto number = static_cast<std::uint16_t>(surface_.textures.size() - 1);
    numbers_.emplace(std::move(key), number);
    return number;
}

std::uint16_t TextureImages::drop(const Key &key, const std::string &why) {
    report_.push_back(line_of(Warning::missing_image, line_name(key.first), why));
    numbers_.emplace(key, Surface::kNoTexture);
    return Surface::kNoTexture;
}

void set_texture(Surface &surface, std::size_t triangle, std::uint16_t texture, const TextureCorners &corners) {
    if (surface.texture_ids.empty() && texture == Surface::kNoTexture)
        return; // arrays begin with the first textured one
    surface.texture_ids.resize(triangle, Surface::kNoTexture);
    surface.texture_corners.resize(triangle);
    surface.texture_ids.push_back(texture);
    surface.texture_corners.push_back(corners);
    constexpr float kFar = 1e6F;
    for (glm::vec2 &corner : surface.texture_corners.back())
        if (!(std::abs(corner.x) < kFar && std::abs(corner.y) < kFar))
            corner = glm::vec2(0.0F);
}

void report_textures(Surface &surface) {
    if (surface.texture_ids.empty()) {
        surface.report.push_back({"texture coordinates", Fate::dropped, "no image belongs to them"});
        return;
    }
    const auto without = std::count(surface.texture_ids.begin(), surface.texture_ids.end(), Surface::kNoTexture);
    surface.report.push_back({"texture coordinates", Fate::converted,
                              without == 0
                                  ? "colours of points"
                                  : "colours of points; " + std::to_string(without) + " triangles have no image"});
}

} // namespace pbm::build
