// Pictures of golden files with a fixed camera: format_spec/golden/README.md
#pragma once

#include "pbm_format/hashes/hash.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/surroundings/surroundings.h"
#include "pbm_render/tables/table_renderer.h"
#include "system/files/mapped_file.h"
#include "unit/support/value_of.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::golden {

using Json = nlohmann::ordered_json;

inline constexpr int kWidth = 96, kHeight = 72, kCell = 12; // pixels

inline std::string hex(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : bytes) {
        text += kDigits[byte >> 4];
        text += kDigits[byte & 15];
    }
    return text;
}

// XXH3-128, low half first, of red, green, blue, alpha of each pixel, top row first.
inline std::string hash_of(const Framebuffer &picture) {
    StreamingHash hash;
    for (const std::uint32_t pixel : picture.colour) {
        const Rgba8 colour = unpack_rgba(pixel);
        hash.add(colour);
    }
    const Hash128 whole = hash.finish();
    Bytes bytes;
    for (const std::uint64_t half : whole)
        for (int shift = 0; shift < 64; shift += 8)
            bytes.push_back(static_cast<std::uint8_t>(half >> shift));
    return hex(bytes);
}

// Means of red, green, blue of each cell of 12 x 12 pixels.
inline Bytes coarse(const Framebuffer &picture) {
    Bytes means;
    for (int top = 0; top < kHeight; top += kCell)
        for (int left = 0; left < kWidth; left += kCell)
            for (std::size_t c = 0; c < 3; ++c) {
                int sum = 0;
                for (int i = 0; i < kCell * kCell; ++i) {
                    const int pixel = (top + i / kCell) * kWidth + left + i % kCell;
                    sum += unpack_rgba(picture.colour[static_cast<std::size_t>(pixel)])[c];
                }
                means.push_back(static_cast<std::uint8_t>(sum / (kCell * kCell)));
            }
    return means;
}

// As when the first versions were frozen: colours took the light that everything takes.
inline const RenderOptions kLook{.shading = Shading::lit};

// A golden file with a fixed camera.
class Scene {
  public:
    Scene(ByteView file, const Camera &camera)
        : camera_(camera), streamed_(value_of(Reader::open(file)), {.threads = 1}),
          surroundings_(std::make_shared<const Surroundings>(parameters(), value_of(read_images(streamed_.reader())))),
          detail_(value_of(streamed_.load({.camera = camera, .width = kWidth, .height = kHeight, .max_error = 1}))) {}

    Framebuffer fast(int threads = 1) const { return draw<FastRenderer>(threads); }
    Framebuffer fine(int threads = 1) const { return draw<FineRenderer>(threads, 4); }
    Framebuffer plain(const Model &model) const { return draw_whole<ReferenceRenderer>(model); }
    Framebuffer tables(const Model &model) const { return draw_whole<TableRenderer>(model); }

  private:
    const ModelParameters &parameters() const { return streamed_.reader().parameters(); }

    // `own`: parameters that only this renderer has.
    template <class Renderer, class... Own> Framebuffer draw(int threads, Own... own) const {
        Framebuffer picture(kWidth, kHeight);
        Renderer renderer(parameters(), streamed_.reader().header().chunk_points, threads, surroundings_);
        renderer.render(detail_.runs, camera_, kLook, picture, own...);
        return picture;
    }

    template <class Renderer> Framebuffer draw_whole(const Model &model) const {
        Framebuffer picture(kWidth, kHeight);
        Renderer(model, surroundings_).render(camera_, kLook, picture);
        return picture;
    }

    Camera camera_;
    StreamedModel streamed_;
    std::shared_ptr<const Surroundings> surroundings_;
    Detail detail_;
};

inline glm::dvec3 vector_of(const Json &v) { return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()}; }

inline Camera camera_of(const Json &json) {
    return {.position = vector_of(json.at("position")),
            .focal_point = vector_of(json.at("focal_point")),
            .up = vector_of(json.at("up")),
            .view_angle = json.at("view_angle")};
}

inline Model model_of(ByteView file) {
    Reader reader = value_of(Reader::open(file));
    return value_of(load_model(reader, {.threads = 1}));
}

inline std::vector<std::filesystem::path> versions() {
    std::vector<std::filesystem::path> folders;
    for (const auto &folder : std::filesystem::directory_iterator(PBM_SOURCE_DIR "/format_spec/golden"))
        if (folder.is_directory())
            folders.push_back(folder.path());
    return folders;
}

inline Json read_json(const std::filesystem::path &path) {
    std::ifstream in(path);
    return in ? Json::parse(in) : Json{{"files", Json::array()}};
}

} // namespace pbm::golden
