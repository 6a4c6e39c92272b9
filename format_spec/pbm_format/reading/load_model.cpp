#include "pbm_format/reading/load_model.h"

#include "pbm_format/rasters/tiled_image.h"

namespace pbm {

namespace {

// Mip level 0 of all rasters.
Status load_images(const TiledImages &images, int threads, ModelImages &to) {
    Status status;
    const auto load = [&](const std::shared_ptr<const TiledImage> &image, Image &into) {
        if (!status || image == nullptr)
            return;
        Result<Image> level = image->level_image(0, threads);
        if (level)
            into = std::move(level).value();
        else
            status = std::move(level).error();
    };
    load(images.ground_texture, to.ground_texture);
    to.ground_lit.resize(images.ground_lit.size());
    for (std::size_t light = 0; light < images.ground_lit.size(); ++light)
        load(images.ground_lit[light], to.ground_lit[light]);
    load(images.panorama, to.panorama);
    return status;
}

} // namespace

Result<Model> load_model(Reader &reader, const LoadOptions &options) try {
    const Result<TiledImages> images = read_images(reader);
    if (!images)
        return images.error();
    std::uint64_t texels = 0; // bytes
    images->for_each([&](const TiledImage &image) { texels += image.grid().texel_bytes(); });
    Result<Model> model = load_points(reader, options, texels);
    if (!model)
        return model;
    if (Status status = load_images(*images, options.threads, model->images); !status)
        return std::move(status).error();
    return model;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

} // namespace pbm
