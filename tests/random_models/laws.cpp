#include "random_models/laws.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/surroundings/surroundings.h"
#include "unit/support/value_of.h"

#include <memory>

namespace pbm::test {

namespace {

constexpr int kWidth = 24, kHeight = 16;

Judgement broken(std::string law) { return {.valid = false, .broken = std::move(law)}; }

// Draws a small picture of a valid file with all renderers; returns what went wrong.
std::string draw(ByteView file, const Model &model) {
    Reader reader = value_of(Reader::open(file));
    const Result<TiledImages> images = read_images(reader);
    if (!images)
        return "valid, but its rasters are not: " + images.error().message;
    const std::uint32_t chunk_points = reader.header().chunk_points;
    StreamedModel streamed(std::move(reader), {.threads = 1});
    const Result<Extent> bounds = streamed.bounds();
    if (!bounds)
        return "valid, but has no bounds: " + bounds.error().message;
    DetailView view;
    view.camera = default_camera(*bounds, model.parameters.grid.up, kWidth, kHeight);
    view.width = kWidth;
    view.height = kHeight;
    if (!is_usable(view.camera)) // a grid so far away that eye and focal point coincide after rounding
        return {};
    const Result<Detail> detail = streamed.load(view);
    if (!detail)
        return "valid, but cannot be drawn: " + detail.error().message;
    const auto surroundings = std::make_shared<const Surroundings>(model.parameters, *images);
    Framebuffer target(kWidth, kHeight);
    const RenderOptions options;
    FastRenderer(model.parameters, chunk_points, 1, surroundings).render(detail->runs, view.camera, options, target);
    FineRenderer(model.parameters, chunk_points, 1, surroundings).render(detail->runs, view.camera, options, target, 2);
    ReferenceRenderer(model, surroundings).render(view.camera, options, target);
    const std::vector<Error> errors = surroundings->take_errors();
    return errors.empty() ? "" : "valid, but a tile is not: " + errors.front().message;
}

std::string draw(ByteView file) {
    Reader reader = value_of(Reader::open(file));
    const Result<Model> model = load_model(reader, {.threads = 1, .fields = true});
    return model ? draw(file, *model) : "valid, but does not load: " + model.error().message;
}

// Verdicts of `verify` and `validate`.
Judgement compare(ByteView file) {
    const Status read = verify(file, {.threads = 1});
    const ValidationReport report = validate(file, {.threads = 1});
    if (report.valid() != read.ok())
        return broken(read ? "verify finds nothing, validate " + report.findings.front().message
                           : "validate finds nothing, verify " + read.error().message);
    for (const Finding &finding : report.findings)
        if (finding.offset > file.size() || finding.message.empty())
            return broken("a finding outside the file: " + finding.message);
    if (!read && has_offset(read.error()) && read.error().offset > file.size())
        return broken("an error outside the file: " + read.error().message);
    return {.valid = read.ok(), .broken = {}};
}

} // namespace

Judgement judge(ByteView file) {
    Judgement judgement = compare(file);
    if (judgement.valid)
        judgement.broken = draw(file);
    return judgement;
}

Judgement judge_valid(ByteView file, const Model &model) {
    Judgement judgement = compare(file);
    if (!judgement.broken.empty())
        return judgement;
    Result<Reader> reader = Reader::open(file);
    if (!judgement.valid)
        return broken("false alarm: " + verify(file, {.threads = 1}).error().message);
    const Result<Model> loaded = load_model(*reader, {.threads = 1, .fields = true});
    if (!loaded)
        return broken("valid, but does not load: " + loaded.error().message);
    if (*loaded != model)
        return broken("another model comes back");
    const Result<Bytes> again =
        encode_model(*loaded, {.compression_level = 1, .chunk_points = reader->header().chunk_points, .threads = 1});
    if (!again || Reader::open(*again)->header().content_id != reader->header().content_id)
        return broken("encoded anew it is another model");
    judgement.broken = draw(file, model);
    return judgement;
}

} // namespace pbm::test
