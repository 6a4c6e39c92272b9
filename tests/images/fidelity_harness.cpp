// fidelity_harness MESH FILE.bvg [--max-error PIXELS] [--finest L] [--reference LEVEL] [--resolution WxH] [--json]:
// how true the pictures of a model are to its mesh, drawn as pbm-render draws them or by the reference renderer.
#include "fidelity.h"
#include "pbm_format/platform.h"
#include "pbm_format/reader.h"
#include "pbm_scan/surface_reader.h"

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace pbm;

int fail(const std::string &file, const Error &error) {
    std::cerr << "fidelity_harness: " << file << ": " << error.message << "\n";
    return exit_code(error.code);
}

struct Options {
    double max_error = kDefaultMaxError;
    int finest = kMaxDepth;
    int reference = 0; // level; 0: the fast renderer
    int width = 1280, height = 720;
    bool json = false;
};

std::vector<View> measure_reference(const RayCaster &rays, ByteView file, std::span<const Camera> cameras,
                                    const Options &options) {
    Reader reader = Reader::open(file).value();
    const auto model = load_model(reader);
    if (!model)
        throw std::runtime_error(model.error().message);
    const ReferenceRenderer renderer(*model);
    return measure_fidelity(rays, draw_level(renderer, model->parameters.grid, options.reference), cameras,
                            options.width, options.height, 0);
}

int run(const std::string &mesh_file, const std::string &model_file, const Options &options) {
    const auto surface = build::read_surface(mesh_file, build::ReadOptions{});
    if (!surface)
        return fail(mesh_file, surface.error());
    const auto file = MappedFile::open(model_file);
    if (!file)
        return fail(model_file, file.error());
    auto reader = Reader::open(file->bytes());
    if (!reader)
        return fail(model_file, reader.error());
    StreamedModel model(std::move(*reader));
    const auto bounds = model.bounds();
    if (!bounds)
        return fail(model_file, bounds.error());

    const ModelParameters &parameters = model.reader().parameters();
    const TriangleMesh mesh{surface->positions, surface->triangles};
    const RayCaster rays(mesh, bounds->centre);
    const auto cameras = eight_views(*bounds, parameters.grid.up, options.width, options.height);
    FastRenderer renderer(parameters, model.reader().header().chunk_points, 0);
    const std::vector<View> views =
        options.reference > 0 ? measure_reference(rays, file->bytes(), cameras, options)
                              : measure_fidelity(rays, draw_detail(model, renderer, options.max_error, options.finest),
                                                 cameras, options.width, options.height, 0);
    if (!options.json)
        std::printf("level %d, %llu points, %.3f pixels per voxel\n", views[0].drawn.level,
                    static_cast<unsigned long long>(views[0].drawn.points),
                    views[0].pixels_per_unit * parameters.grid.voxel_size_at(views[0].drawn.level));
    std::fputs((options.json ? to_json(views) : to_text(views)).c_str(), stdout);
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    std::vector<std::string> files;
    Options options;
    int &width = options.width, &height = options.height;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        const bool has_value = i + 1 < argc;
        if (argument == "--json")
            options.json = true;
        else if (argument == "--max-error" && has_value)
            options.max_error = std::atof(argv[++i]);
        else if (argument == "--finest" && has_value)
            options.finest = std::atoi(argv[++i]);
        else if (argument == "--reference" && has_value)
            options.reference = std::atoi(argv[++i]);
        else if (argument == "--resolution" && has_value && std::sscanf(argv[i + 1], "%dx%d", &width, &height) == 2)
            ++i;
        else
            files.push_back(argument);
    }
    if (files.size() != 2 || width < 1 || height < 1 || width > kMaxPictureEdge || height > kMaxPictureEdge ||
        !(options.max_error > 0) || options.finest < 1 || options.reference < 0) {
        std::cerr << "fidelity_harness MESH FILE.bvg [--max-error PIXELS] [--finest L] [--reference LEVEL] "
                     "[--resolution WxH] [--json]\n";
        return 1;
    }
    try {
        return run(files[0], files[1], options);
    } catch (const std::exception &error) {
        std::cerr << "fidelity_harness: " << error.what() << "\n";
        return 4;
    }
}
