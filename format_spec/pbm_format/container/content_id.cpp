#include "pbm_format/container/content_id.h"

#include "pbm_format/container/section_encoder.h"

namespace pbm {

namespace {

// Level 0 only: mip levels follow from it.
void add_raster(const Image &image, SectionType type, std::uint32_t instance, StreamingHash &hash) {
    ByteWriter head;
    head.u32(static_cast<std::uint32_t>(type));
    head.u32(instance);
    head.u32(image.width);
    head.u32(image.height);
    hash.add(head.bytes());
    hash.add(image.texels);
}

} // namespace

ContentId content_id(const Model &model, std::span<const std::vector<ChunkShape>> chunks, std::uint32_t chunk_points) {
    const ModelParameters &parameters = model.parameters;
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
    StreamingHash hash;
    hash.add(head.bytes());
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        ByteWriter roots;
        for (const ChunkShape &chunk : chunks[level]) {
            roots.u8(chunk.root_depth);
            roots.u64(chunk.root_prefix);
        }
        hash.add(roots.bytes());
        hash.add(model.levels[level].masks);
    }
    const PointAttributes &finest = model.levels.back().points;
    const PointView points = view_points(finest, 0, finest.size(), parameters.attributes);
    for (const StreamInfo &stream : point_streams())
        hash.add(bytes_of(points, stream));
    const ModelImages &images = model.images;
    if (!images.ground_texture.empty())
        add_raster(images.ground_texture, SectionType::ground_texture, 0, hash);
    for (std::size_t light = 0; light < images.ground_lit.size(); ++light)
        add_raster(images.ground_lit[light], SectionType::ground_lit, static_cast<std::uint32_t>(light), hash);
    if (!images.panorama.empty())
        add_raster(images.panorama, SectionType::panorama, 0, hash);
    return hash.finish();
}

} // namespace pbm
