#include <pbm/format.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char **argv) {
    const auto fail = [](const pbm::Error &error) {
        return std::fprintf(stderr, "%s\n", error.message.c_str()), pbm::exit_code(error.code);
    };
    if (argc < 2)
        return 1;
    const auto file = pbm::MappedFile::open(argv[1]); // owns the bytes; everything below only views them
    if (!file)
        return fail(file.error());
    auto reader = pbm::Reader::open(file->bytes());
    if (!reader)
        return fail(reader.error());
    const auto model = pbm::load_model(*reader, {.max_level = argc > 2 ? std::atoi(argv[2]) : reader->depth()});
    if (!model)
        return fail(model.error());
    std::vector<pbm::MortonCode> voxels{0}; // of level 0; each level's masks give those of the next one
    for (std::size_t level = 1; level < model->levels.size(); ++level)
        voxels = *pbm::expand_level(voxels, model->levels[level].masks, model->levels[level].points.size());
    const pbm::Grid &grid = model->parameters.grid;
    const double edge = grid.voxel_size_at(static_cast<int>(model->levels.size()) - 1);
    for (const pbm::MortonCode voxel : voxels) {
        const auto [x, y, z] = pbm::morton_decode(voxel);
        std::printf("%.9g %.9g %.9g\n", grid.origin[0] + (x + 0.5) * edge, grid.origin[1] + (y + 0.5) * edge,
                    grid.origin[2] + (z + 0.5) * edge);
    }
}
