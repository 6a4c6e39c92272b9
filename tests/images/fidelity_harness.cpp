// fidelity_harness MESH FILE.bvg [--level L] [--resolution WxH] [--json]: how true the pictures of a model are to its
// mesh.
#include "fidelity.h"
#include "pbm_format/platform.h"
#include "pbm_format/reader.h"
#include "pbm_scan/surface_reader.h"

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

namespace {

using namespace pbm;

int fail(const std::string &file, const Error &error) {
    std::cerr << "fidelity_harness: " << file << ": " << error.message << "\n";
    return exit_code(error.code);
}

int run(const std::string &mesh_file, const std::string &model_file, int level, int width, int height, bool json) {
    const auto surface = build::read_surface(mesh_file, build::ReadOptions{});
    if (!surface)
        return fail(mesh_file, surface.error());
    const auto file = MappedFile::open(model_file);
    if (!file)
        return fail(model_file, file.error());
    auto reader = Reader::open(file->bytes());
    if (!reader)
        return fail(model_file, reader.error());
    const auto model = load_model(*reader);
    if (!model)
        return fail(model_file, model.error());

    const TriangleMesh mesh{surface->positions, surface->triangles};
    const RayCaster rays(mesh, bounding_sphere(*model).centre);
    const std::vector<View> views = measure_fidelity(rays, *model, level, width, height, 0);
    if (!json)
        std::printf("level %d, %llu points, %.3f pixels per voxel\n", views[0].drawn.level,
                    static_cast<unsigned long long>(views[0].drawn.points), views[0].voxel_pixels);
    std::fputs((json ? to_json(views) : to_text(views)).c_str(), stdout);
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    std::vector<std::string> files;
    int level = kMaxDepth, width = 1280, height = 720;
    bool json = false;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument == "--json")
            json = true;
        else if (argument == "--level" && i + 1 < argc)
            level = std::atoi(argv[++i]);
        else if (argument == "--resolution" && i + 1 < argc && std::sscanf(argv[i + 1], "%dx%d", &width, &height) == 2)
            ++i;
        else
            files.push_back(argument);
    }
    if (files.size() != 2 || width < 1 || height < 1 || width > kMaxPictureEdge || height > kMaxPictureEdge) {
        std::cerr << "fidelity_harness MESH FILE.bvg [--level L] [--resolution WxH] [--json]\n";
        return 1;
    }
    try {
        return run(files[0], files[1], level, width, height, json);
    } catch (const std::exception &error) {
        std::cerr << "fidelity_harness: " << error.what() << "\n";
        return 4;
    }
}
