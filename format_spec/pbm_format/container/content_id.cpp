#include "pbm_format/container/content_id.h"

#include "pbm_format/container/section_encoder.h"
#include "pbm_format/hashes/hash.h"

namespace pbm {

Bytes content_of_raster(SectionType type, std::uint32_t instance, std::uint32_t width, std::uint32_t height) {
    ByteWriter head;
    head.u32(static_cast<std::uint32_t>(type));
    head.u32(instance);
    head.u32(width);
    head.u32(height);
    return head.take();
}

void visit_content(const ModelParameters &parameters, std::span<const std::vector<ChunkShape>> chunks,
                   std::uint32_t chunk_points, const ContentPieces &pieces) {
    ByteWriter head;
    head.u32(static_cast<std::uint32_t>(parameters.grid.depth));
    head.u32(chunk_points);
    head.append(encode_grid(parameters.grid));
    head.append(encode_attributes(parameters.attributes, parameters.grid.depth));
    head.append(encode_materials(parameters.materials));
    head.append(encode_lights(parameters.lights));
    for (const SolidTexture &texture : parameters.texture)
        head.append(encode_texture(texture));
    if (parameters.ground)
        head.append(encode_ground_plane(*parameters.ground));
    pieces.bytes(head.bytes());
    for (std::size_t level = 1; level < chunks.size(); ++level) {
        ByteWriter roots;
        for (const ChunkShape &chunk : chunks[level]) {
            roots.u8(chunk.root_depth);
            roots.u64(chunk.root_prefix);
        }
        pieces.bytes(roots.bytes());
        pieces.masks(level);
    }
    for (const StreamInfo &stream : point_streams())
        pieces.stream(stream);
}

ContentId content_id(const Model &model, std::span<const std::vector<ChunkShape>> chunks, std::uint32_t chunk_points) {
    StreamingHash hash;
    const PointAttributes &finest = model.levels.back().points;
    const PointView points = view_points(finest, 0, finest.size(), model.parameters.attributes);
    visit_content(model.parameters, chunks, chunk_points,
                  {.bytes = [&](ByteView bytes) { hash.add(bytes); },
                   .masks = [&](std::size_t level) { hash.add(model.levels[level].masks); },
                   .stream = [&](const StreamInfo &stream) { hash.add(bytes_of(points, stream)); }});
    // Level 0 only: mip levels follow from it.
    const auto add_raster = [&](const Image &image, SectionType type, std::size_t instance) {
        hash.add(content_of_raster(type, static_cast<std::uint32_t>(instance), image.width, image.height));
        hash.add(image.texels);
    };
    const ModelImages &images = model.images;
    if (!images.ground_texture.empty())
        add_raster(images.ground_texture, SectionType::ground_texture, 0);
    for (std::size_t light = 0; light < images.ground_lit.size(); ++light)
        add_raster(images.ground_lit[light], SectionType::ground_lit, light);
    if (!images.panorama.empty())
        add_raster(images.panorama, SectionType::panorama, 0);
    return hash.finish();
}

} // namespace pbm
