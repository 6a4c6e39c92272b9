#include "viewer/pbm-view/light/shadow_copy.h"

#include "pbm_bake/shadow_baker.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_render/surroundings/texel_levels.h"

#include <algorithm>
#include <utility>

namespace pbm {
namespace {

// Memory beyond the decoded streams, bytes per point: codes, bricks, offsets, votes, averages.
constexpr std::uint64_t kBytesPerPoint = 32;

// Of the part of a shadow map that the ground looks up, and of the rasters.
std::uint64_t ground_bytes(const TiledImages &images) {
    constexpr std::uint64_t kMapBytes = std::uint64_t{64} << 20;
    return images.ground_lit.empty() ? 0 : kMapBytes + 8 * images.ground_lit.front()->grid().texel_bytes();
}

} // namespace

Bytes stored_fractions(const LitFractions &fractions, int bits) {
    const int step = 255 / ((1 << bits) - 1);
    Bytes stored = fractions.levels.back();
    for (std::uint8_t &value : stored)
        value = static_cast<std::uint8_t>(value / step);
    return stored;
}

Result<std::unique_ptr<ShadowCopy>> ShadowCopy::load(ByteView file, int threads, std::uint64_t max_memory) {
    auto reader = Reader::open(file);
    if (!reader)
        return reader.error();
    const auto images = read_images(*reader);
    if (!images)
        return images.error();
    const std::uint64_t more = kBytesPerPoint * reader->header().point_count + ground_bytes(*images);
    Result<Model> model = load_points(*reader, {.threads = threads, .max_memory = max_memory}, more);
    if (!model)
        return model.error();
    std::vector<std::uint32_t> edges;
    for (const auto &image : images->ground_lit)
        edges.push_back(image->width());
    return std::unique_ptr<ShadowCopy>(new ShadowCopy(std::move(*model), std::move(edges), threads));
}

ShadowCopy::ShadowCopy(Model model, std::vector<std::uint32_t> ground_edges, int threads)
    : model_(std::move(model)), ground_edges_(std::move(ground_edges)), casters_(model_, threads) {
    PointAttributes finest; // `casters_` refers to what it keeps
    finest.normals = std::move(model_.levels.back().points.normals);
    finest.radii = std::move(model_.levels.back().points.radii);
    for (Level &level : model_.levels)
        level.points = {};
    model_.levels.back().points = std::move(finest);
}

std::shared_ptr<const BakedShadows> ShadowCopy::bake(const Light &light, std::size_t index, int threads,
                                                     const std::atomic<bool> &stop) const {
    const ModelParameters &parameters = model_.parameters;
    const auto &bits = parameters.attributes.shadow_bits[index];
    ShadowOptions options{.bits = bits[static_cast<std::size_t>(parameters.grid.depth)]};
    options.threads = threads;
    options.stop = &stop;
    const Bytes finest = bake_light(casters_, light, options);
    BakedShadows baked{.light = light, .fractions = nullptr, .ground = {}};
    if (index < ground_edges_.size() && !stop) {
        options.maps = kHardGroundMaps;
        baked.ground = bake_ground(casters_, light, *parameters.ground, ground_edges_[index], options);
    }
    if (stop)
        return nullptr;
    LitFractions fractions;
    LevelMasks masks;
    for (const Level &level : model_.levels)
        masks.push_back(level.masks);
    fractions.levels = lit_levels(masks, bits, finest);
    if (!baked.ground.empty())
        fractions.ground = std::make_shared<const TexelLevels>(
            std::vector{std::make_shared<const TiledImage>(TiledImage::of(baked.ground))}, std::uint8_t{255});
    baked.fractions = std::make_shared<const LitFractions>(std::move(fractions));
    return std::make_shared<const BakedShadows>(std::move(baked));
}

} // namespace pbm
