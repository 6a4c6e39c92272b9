// Draws a model into a PPM file: draw_picture FILE.pbvg OUTPUT.ppm
#include <pbm_format/reading/reader.h>
#include <pbm_render/reference/reference_renderer.h>
#include <system/files/platform.h>

#include <cstdio>
#include <fstream>

namespace {

int fail(const pbm::Error &error) {
    std::fprintf(stderr, "draw_picture: byte %llu: %s\n", static_cast<unsigned long long>(error.offset),
                 error.message.c_str());
    return pbm::exit_code(error.code);
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 3)
        return std::fputs("usage: draw_picture FILE.pbvg OUTPUT.ppm\n", stderr), 1;

    const auto file = pbm::MappedFile::open(argv[1]);
    if (!file)
        return fail(file.error());
    auto reader = pbm::Reader::open(file.value().bytes());
    if (!reader)
        return fail(reader.error());
    const auto model = pbm::load_model(reader.value());
    if (!model)
        return fail(model.error());

    pbm::Framebuffer picture(640, 480);
    const pbm::Camera camera = pbm::default_camera(model.value(), picture.width, picture.height);
    pbm::ReferenceRenderer(model.value()).render(camera, {}, picture);

    std::ofstream out(argv[2], std::ios::binary);
    out << "P6\n" << picture.width << ' ' << picture.height << "\n255\n";
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
        const pbm::Rgba8 c = pbm::unpack_rgba(picture.colour[i]);
        out.put(static_cast<char>(c[0])).put(static_cast<char>(c[1])).put(static_cast<char>(c[2]));
    }
    return out.flush() ? 0 : 2;
}
