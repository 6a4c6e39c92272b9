#include "judge.h"

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/reader.h"
#include "pbm_render/fast/fast_renderer.h"
#include "unit/support/value_of.h"

namespace pbm::faults {

namespace {

Status load_all(StreamedModel &model, const DetailView &view) {
    const Result<Detail> loaded = model.load(view);
    return loaded ? Status() : Status(loaded.error());
}

} // namespace

DetailView whole_view(const Sphere &bounds, UpAxis up) {
    DetailView view{.camera = camera_around(bounds, up, kPictureWidth, kPictureHeight),
                    .width = kPictureWidth,
                    .height = kPictureHeight,
                    .max_error = 0.01};
    view.camera.position += up_direction(up) * (2 * bounds.radius); // the ground is visible from above only
    return view;
}

Result<Shown> show(ByteView file, const DetailView &view, int threads) {
    Result<Reader> reader = Reader::open(file);
    if (!reader)
        return std::move(reader).error();
    Result<TiledImages> images = read_images(*reader);
    if (!images)
        return std::move(images).error();
    Shown shown;
    shown.images = *images;
    shown.model = std::make_unique<StreamedModel>(value_of(std::move(reader)), StreamingOptions{.threads = threads});
    shown.surroundings =
        std::make_shared<const Surroundings>(shown.model->reader().parameters(), value_of(std::move(images)));
    // An error concerns one chunk: repeat until all others are loaded.
    for (Status loaded; !(loaded = load_all(*shown.model, view));)
        if (loaded.error().code == ErrorCode::memory)
            return std::move(loaded).error();
    shown.detail = shown.model->choose(view);
    return shown;
}

Framebuffer draw(const Shown &shown, const DetailView &view) {
    FastRenderer renderer(shown.model->reader().parameters(), shown.model->reader().header().chunk_points, 1,
                          shown.surroundings);
    Framebuffer picture(view.width, view.height);
    renderer.render(shown.detail.runs, view.camera, {}, picture);
    return picture;
}

Status open_and_draw(ByteView file, int threads) {
    Result<Reader> reader = Reader::open(file);
    if (!reader)
        return std::move(reader).error();
    const UpAxis up = reader->parameters().grid.up;
    StreamedModel model(value_of(std::move(reader)), {.threads = threads});
    const Result<Extent> bounds = model.bounds();
    if (!bounds)
        return bounds.error();
    const DetailView view = whole_view(bounds->sphere, up);
    if (!is_usable(view.camera)) // a very small or distant grid may leave no camera after rounding
        return usage_error("no camera");
    Result<Shown> shown = show(file, view, threads);
    if (!shown)
        return std::move(shown).error();
    draw(*shown, view);
    return {};
}

} // namespace pbm::faults
