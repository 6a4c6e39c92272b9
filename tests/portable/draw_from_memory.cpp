// All that pbm_render alone can do, linked without anything that needs an operating system: draws the file on standard
// input with each renderer, as a whole and range by range, and fails if two pictures differ.
#include "pbm_format/reading/load_model.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/tables/table_renderer.h"

#include <array>
#include <cstdio>

namespace {

using namespace pbm;

constexpr int kWidth = 64, kHeight = 48; // pixels

// The picture of each renderer that draws whole models.
template <class Renderer> Framebuffer draw_model(Reader &reader, const Camera &camera) {
    const Result<Model> model = load_model(reader);
    Framebuffer picture(kWidth, kHeight);
    if (model)
        Renderer(*model).render(camera, {}, picture);
    return picture;
}

// The picture of each renderer that draws while chunks arrive.
template <class Renderer>
Framebuffer draw(StreamedModel &model, SparseFile *sparse, ByteView file, const Camera &camera) {
    const DetailView view{.camera = camera, .width = kWidth, .height = kHeight};
    Result<Detail> detail = model.load(view);
    for (; detail && !detail->wanted.empty(); detail = model.load(view))
        for (const FileRange &range : detail->wanted)
            sparse->fill(range.offset, slice(file, range.offset, range.bytes));
    Framebuffer picture(kWidth, kHeight);
    const Reader &reader = model.reader();
    if (detail)
        Renderer(reader.parameters(), reader.header().chunk_points, 1).render(detail->runs, camera, {}, picture);
    return picture;
}

bool same(const Framebuffer &a, const Framebuffer &b) { return a.colour == b.colour && a.depth == b.depth; }

} // namespace

int main() {
    Bytes file;
    std::array<std::uint8_t, 65536> block;
    for (std::size_t count = 0; (count = std::fread(block.data(), 1, block.size(), stdin)) > 0;)
        file.insert(file.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(count));
    Result<Reader> reader = Reader::open(file);
    if (!reader)
        return exit_code(reader.error().code);
    StreamedModel whole(std::move(*reader));
    const Result<Extent> bounds = whole.bounds();
    if (!bounds)
        return exit_code(bounds.error().code);
    const Camera camera = default_camera(*bounds, whole.reader().parameters().grid.up, kWidth, kHeight);

    const auto sparse = std::make_shared<SparseFile>(file.size());
    const ByteSource source(sparse);
    for (FileRange range = Reader::opening_range(source); range.bytes > 0; range = Reader::opening_range(source))
        sparse->fill(range.offset, slice(file, range.offset, range.bytes));
    StreamedModel streamed(Reader::open(source).value());
    bool is_same = same(draw<FastRenderer>(whole, nullptr, file, camera),
                        draw<FastRenderer>(streamed, sparse.get(), file, camera));
    is_same &= same(draw<FineRenderer>(whole, nullptr, file, camera),
                    draw<FineRenderer>(streamed, sparse.get(), file, camera));
    sparse->fill(0, file);
    Reader first = Reader::open(file).value(), second = Reader::open(source).value();
    is_same &= same(draw_model<ReferenceRenderer>(first, camera), draw_model<ReferenceRenderer>(second, camera));
    is_same &= same(draw_model<TableRenderer>(first, camera), draw_model<TableRenderer>(second, camera));
    std::puts(is_same ? "the same pictures" : "different pictures");
    return is_same ? 0 : 1;
}
