// Draws a whole model with the reference renderer into a PPM file: draw_picture FILE.pbvg OUTPUT.ppm
#include <pbm/render.h>

#include <cstdio>
#include <fstream>

int main(int argc, char **argv) {
    const auto fail = [](const pbm::Error &error) {
        std::fprintf(stderr, "byte %llu: %s\n", static_cast<unsigned long long>(error.offset), error.message.c_str());
        return pbm::exit_code(error.code);
    };
    if (argc != 3)
        return std::fputs("usage: draw_picture FILE.pbvg OUTPUT.ppm\n", stderr), 1;
    const auto file = pbm::MappedFile::open(argv[1]);
    if (!file)
        return fail(file.error());
    auto reader = pbm::Reader::open(file->bytes());
    if (!reader)
        return fail(reader.error());
    const auto model = pbm::load_points(*reader);
    if (!model)
        return fail(model.error());

    pbm::Framebuffer picture(640, 480);
    const pbm::Camera camera = pbm::default_camera(*model, picture.width, picture.height);
    pbm::ReferenceRenderer(*model).render(camera, {}, picture);

    std::ofstream out(argv[2], std::ios::binary);
    out << "P6\n" << picture.width << ' ' << picture.height << "\n255\n";
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
        const pbm::Rgba8 c = pbm::unpack_rgba(picture.colour[i]);
        out.put(static_cast<char>(c[0])).put(static_cast<char>(c[1])).put(static_cast<char>(c[2]));
    }
    return out.flush() ? 0 : 2;
}
