// Draws a close-up of a model and reads only the ranges of the file that the picture needs, as from a server that
// answers range requests: draw_by_ranges FILE.pbvg
#include <pbm/render.h>

#include <cstdio>
#include <fstream>

int main(int argc, char **argv) {
    const auto fail = [](const pbm::Error &error) {
        std::fprintf(stderr, "byte %llu: %s\n", static_cast<unsigned long long>(error.offset), error.message.c_str());
        return pbm::exit_code(error.code);
    };
    std::ifstream server(argc == 2 ? argv[1] : "", std::ios::binary | std::ios::ate);
    if (!server)
        return std::fputs("usage: draw_by_ranges FILE.pbvg\n", stderr), 1;
    const auto file = std::make_shared<pbm::SparseFile>(static_cast<std::uint64_t>(server.tellg()));
    unsigned long long ranges = 0, bytes = 0;
    const auto fetch = [&](pbm::FileRange range) {
        pbm::Bytes received(range.bytes);
        server.seekg(static_cast<std::streamoff>(range.offset));
        server.read(reinterpret_cast<char *>(received.data()), static_cast<std::streamsize>(received.size()));
        file->fill(range.offset, received);
        ++ranges;
        bytes += range.bytes;
    };

    const pbm::ByteSource source(file);
    for (pbm::FileRange range; (range = pbm::Reader::opening_range(source)).bytes > 0;)
        fetch(range);
    auto reader = pbm::Reader::open(source);
    if (!reader)
        return fail(reader.error());
    pbm::StreamedModel model(std::move(*reader));
    for (const pbm::FileRange &range : model.bounds_wanted())
        fetch(range);
    const auto bounds = model.bounds();
    if (!bounds)
        return fail(bounds.error());

    const auto &parameters = model.reader().parameters();
    pbm::FastRenderer renderer(parameters, model.reader().header().chunk_points, 0);
    pbm::Framebuffer picture(640, 480);
    pbm::DetailView view{
        .camera = pbm::default_camera(*bounds, parameters.grid.up, 640, 480), .width = 640, .height = 480};
    view.camera.view_angle /= 8;
    while (true) {
        const auto detail = model.load(view);
        if (!detail)
            return fail(detail.error());
        const auto drawn = renderer.render(detail->runs, view.camera, {}, picture); // coarse at first
        std::printf("%llu ranges, %llu of %llu bytes: %llu points\n", ranges, bytes,
                    static_cast<unsigned long long>(file->size()), static_cast<unsigned long long>(drawn.drawn_points));
        if (detail->wanted.empty())
            return 0;
        for (const pbm::FileRange &range : detail->wanted)
            fetch(range);
    }
}
