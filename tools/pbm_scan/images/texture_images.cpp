#include "pbm_scan/images/texture_images.h"

#include "pbm_scan/conventions/normal_maps.h"
#include "pbm_scan/images/read_image.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
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

AttributeReport line_of_image(const std::string &name, const Texture &image, const std::string &note) {
    return {line_name(name), Fate::converted,
            std::to_string(image.width) + " x " + std::to_string(image.height) + note +
                (image.has_stray_bytes ? "; bytes that belong to no part of the image left out" : "") +
                orientation_note(image.orientation)};
}

Texture one_texel(const std::array<std::uint8_t, 4> &texel) { return {.width = 1, .height = 1, .texels = {texel}}; }

// Makes the image what the builder takes. Returns the note about it.
std::string settled(Texture &texture) {
    if (texture.use.content == ImageContent::colours)
        return ", to colours of points";
    if (texture.use.content == ImageContent::roughness_metal ||
        texture.use.content == ImageContent::specular_roughness_metal ||
        texture.use.content == ImageContent::specular_gloss) {
        settle_reflectance(texture);
        return ", to materials of points";
    }
    if (texture.use.content == ImageContent::emission) {
        settle_emission(texture);
        return ", to light that points emit";
    }
    if (texture.use.content == ImageContent::occlusion) {
        settle_occlusion(texture);
        return ", to ambient light of points";
    }
    return settle_normals(texture) ? ", heights, to normals of points" : ", to normals of points";
}

TextureUse without_holes(TextureUse use) {
    use.least_opacity = 0;
    use.is_blended = false;
    return use;
}

// Makes `image` as large as the larger of both, and calls mix(texel, texel of the other one). False, and nothing
// changed: that is too large.
template <class Mix> bool mix_in(Texture &image, const Texture &other, const Mix &mix) {
    const std::uint32_t width = std::max(image.width, other.width), height = std::max(image.height, other.height);
    if (std::uint64_t{width} * height > kMaxTextureTexels)
        return false;
    std::vector<std::array<std::uint8_t, 4>> texels;
    texels.reserve(std::size_t{width} * height);
    for (std::uint64_t y = 0; y < height; ++y)
        for (std::uint64_t x = 0; x < width; ++x) {
            const auto at = [&](const Texture &from) {
                return from.texels[y * from.height / height * from.width + x * from.width / width];
            };
            texels.push_back(at(image));
            mix(texels.back(), at(other));
        }
    image.texels = std::move(texels);
    image.width = width;
    image.height = height;
    return true;
}

// Gives `image` the opacity that another image says: its own, or its brightness if it is opaque. False, and nothing
// changed: that is the same image, and opaque; or both together are too large.
bool take_opacity(Texture &image, const Texture &opacity, bool is_inverted, bool is_same) {
    const bool has_opacity =
        std::any_of(opacity.texels.begin(), opacity.texels.end(), [](const auto &texel) { return texel[3] != 255; });
    if (is_same && !has_opacity)
        return false;
    return mix_in(image, opacity, [&](std::array<std::uint8_t, 4> &texel, const std::array<std::uint8_t, 4> &other) {
        const auto brightness = static_cast<std::uint8_t>((other[0] + other[1] + other[2]) / 3);
        texel[3] = has_opacity ? other[3] : brightness;
        texel[3] = is_inverted ? static_cast<std::uint8_t>(255 - texel[3]) : texel[3];
    });
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

std::uint16_t TextureImages::of_files(const std::string &path, const Rgb8 &colour, const OpacityFile &opacity,
                                      const TextureUse &use) {
    const std::string tint =
        std::to_string(colour[0]) + " " + std::to_string(colour[1]) + " " + std::to_string(colour[2]);
    Key key{opacity.path + (opacity.is_inverted ? "\n-\n" : "\n") + tint + "\n" + path, use};
    if (const auto known = numbers_.find(key); known != numbers_.end())
        return known->second;
    Result<Texture> of_opacity = read_image_file(opacity.path);
    if (!of_opacity) {
        drop(Key(opacity.path, use), of_opacity.error().message);
        return path.empty() ? Surface::kNoTexture : of_file(path, without_holes(use));
    }
    const bool is_same = path == opacity.path;
    Result<Texture> image = path.empty() ? one_texel({colour[0], colour[1], colour[2], 255})
                            : is_same    ? *of_opacity
                                         : read_image_file(path);
    if (!image)
        return drop(Key(path, use), image.error().message);
    if (!take_opacity(*image, *of_opacity, opacity.is_inverted, is_same))
        key.second = without_holes(use);
    key.first = path.empty() ? opacity.path : path; // for the report
    const std::uint16_t number = add(key, std::move(*image));
    numbers_.emplace(Key{opacity.path + (opacity.is_inverted ? "\n-\n" : "\n") + tint + "\n" + path, use}, number);
    return number;
}

std::uint16_t TextureImages::of_reflectance(std::span<const ReflectanceImage> images, TextureUse use,
                                            const ReflectanceTexel &plain) {
    use.content = ImageContent::specular_roughness_metal;
    Key key{std::to_string(plain[1]) + " " + std::to_string(plain[2]), use};
    for (const ReflectanceImage &image : images) {
        key.first += "\n" + std::to_string(static_cast<int>(image.part)) + " " + image.name;
        for (const float factor : image.colour)
            key.first += " " + std::to_string(factor);
    }
    if (const auto known = numbers_.find(key); known != numbers_.end())
        return known->second;
    Texture all = one_texel({plain[0], plain[1], plain[2], 255});
    std::size_t count = 0;
    for (const ReflectanceImage &image : images) {
        const Result<Texture> read = image.read();
        if (!read) {
            drop_once(report_, line_name(image.name), read.error().message, Warning::missing_image);
            continue;
        }
        const bool fits =
            mix_in(all, *read, [&](auto &texel, const auto &from) { set_part(image.part, image.colour, from, texel); });
        if (!fits) {
            drop_once(report_, line_name(image.name), "too large together with others of its material");
            continue;
        }
        AttributeReport line = line_of_image(image.name, *read, ", to materials of points");
        const auto is_same = [&](const AttributeReport &said) {
            return said.name == line.name && said.note == line.note;
        };
        if (std::none_of(report_.begin(), report_.end(), is_same)) // one image may have several parts
            report_.push_back(std::move(line));
        ++count;
    }
    if (count == 0)
        return numbers_.emplace(std::move(key), Surface::kNoTexture).first->second;
    all.use = key.second;
    settle_reflectance(all);
    return keep(std::move(key), std::move(all));
}

std::uint16_t TextureImages::of_texel(const TextureUse &use) {
    Key key{"", use};
    if (const auto known = numbers_.find(key); known != numbers_.end())
        return known->second;
    if (surface_.textures.size() == Surface::kNoTexture)
        return Surface::kNoTexture;
    surface_.textures.push_back(one_texel({255, 255, 255, 255}));
    surface_.textures.back().use = use;
    settled(surface_.textures.back());
    return numbers_.emplace(std::move(key), static_cast<std::uint16_t>(surface_.textures.size() - 1)).first->second;
}

std::uint16_t TextureImages::add(Key key, ByteView bytes) {
    Result<Texture> texture = read_image(bytes, are_colours(key.second.content));
    return texture ? add(std::move(key), std::move(*texture)) : drop(key, texture.error().message);
}

std::uint16_t TextureImages::add(Key key, Texture texture) {
    texture.use = key.second;
    if (texture.use.content == ImageContent::normals && is_of_object(texture))
        return drop(key, "its normals are those of the object, not of the directions along the surface");
    const std::string note = settled(texture);
    AttributeReport line = line_of_image(key.first, texture, note);
    const std::uint16_t number = keep(std::move(key), std::move(texture));
    if (number != Surface::kNoTexture)
        report_.push_back(std::move(line));
    return number;
}

std::uint16_t TextureImages::keep(Key key, Texture texture) {
    if (surface_.textures.size() == Surface::kNoTexture)
        return drop(key, "more images than can be numbered");
    bytes_ += 4 * texture.texels.size();
    if (bytes_ > kMaxBytes)
        return drop(key, "the images need more than 8 GiB; make them smaller");
    surface_.textures.push_back(std::move(texture));
    const auto number = static_cast<std::uint16_t>(surface_.textures.size() - 1);
    numbers_.emplace(std::move(key), number);
    return number;
}

std::uint16_t TextureImages::drop(const Key &key, const std::string &why) {
    report_.push_back(line_of(Warning::missing_image, line_name(key.first), why));
    numbers_.emplace(key, Surface::kNoTexture);
    return Surface::kNoTexture;
}

namespace {

void set_texture(std::vector<std::uint16_t> &ids, std::vector<TextureCorners> &places, std::size_t triangle,
                 std::uint16_t texture, const TextureCorners &corners) {
    if (ids.empty() && texture == Surface::kNoTexture)
        return; // arrays begin with the first textured one
    ids.resize(triangle, Surface::kNoTexture);
    places.resize(triangle);
    ids.push_back(texture);
    places.push_back(corners);
    constexpr float kFar = 1e6F;
    for (glm::vec2 &corner : places.back())
        if (!(std::abs(corner.x) < kFar && std::abs(corner.y) < kFar))
            corner = glm::vec2(0.0F);
}

} // namespace

void set_texture(Surface &surface, std::size_t triangle, std::uint16_t texture, const TextureCorners &corners) {
    set_texture(surface.texture_ids, surface.texture_corners, triangle, texture, corners);
}

void set_texture(Surface &surface, Layer layer, std::size_t triangle, std::uint16_t texture,
                 const TextureCorners &corners) {
    set_texture(surface.layer(layer).ids, surface.layer(layer).corners, triangle, texture, corners);
}

void report_textures(Surface &surface) {
    std::vector<std::string> uses;
    if (!surface.texture_ids.empty())
        uses.emplace_back("colours");
    if (!surface.layer(Layer::normals).ids.empty())
        uses.emplace_back("normals");
    if (!surface.layer(Layer::reflectance).ids.empty())
        uses.emplace_back("materials");
    if (!surface.layer(Layer::emission).ids.empty())
        uses.emplace_back("emission");
    if (!surface.layer(Layer::occlusion).ids.empty())
        uses.emplace_back("ambient light");
    if (uses.empty()) {
        surface.report.push_back({"texture coordinates", Fate::dropped, "no image belongs to them"});
        return;
    }
    const auto without = std::count(surface.texture_ids.begin(), surface.texture_ids.end(), Surface::kNoTexture);
    surface.report.push_back({"texture coordinates", Fate::converted,
                              enumerated(uses) + " of points" +
                                  (without == 0 ? "" : "; " + std::to_string(without) + " triangles have no image")});
}

} // namespace pbm::build
