// Prints the points of a detail level, one "x y z" per line: read_points FILE.pbvg [LEVEL]
#include <pbm_format/reading/reader.h>
#include <system/files/platform.h>

#include <cstdio>
#include <cstdlib>

namespace {

int fail(const pbm::Error &error) {
    std::fprintf(stderr, "read_points: byte %llu: %s\n", static_cast<unsigned long long>(error.offset),
                 error.message.c_str());
    return pbm::exit_code(error.code);
}

} // namespace

int main(int argc, char **argv) {
    if (argc < 2)
        return std::fputs("usage: read_points FILE.pbvg [LEVEL]\n", stderr), 1;

    const auto file = pbm::MappedFile::open(argv[1]);
    if (!file)
        return fail(file.error());
    auto reader = pbm::Reader::open(file.value().bytes());
    if (!reader)
        return fail(reader.error());
    const auto model =
        pbm::load_model(reader.value(), {.max_level = argc > 2 ? std::atoi(argv[2]) : reader.value().depth()});
    if (!model)
        return fail(model.error());

    // The nodes of a level stand in Morton order; each level's masks turn the codes above into its own.
    std::vector<pbm::MortonCode> codes = {0};
    const auto &levels = model.value().levels;
    for (std::size_t level = 1; level < levels.size(); ++level)
        codes = pbm::expand_level(codes, levels[level].masks, levels[level].points.size()).value();

    const pbm::Grid &grid = model.value().parameters.grid;
    const double voxel = grid.voxel_size_at(static_cast<int>(levels.size()) - 1);
    for (const pbm::MortonCode code : codes) {
        const auto [x, y, z] = pbm::morton_decode(code);
        std::printf("%.9g %.9g %.9g\n", grid.origin[0] + (x + 0.5) * voxel, grid.origin[1] + (y + 0.5) * voxel,
                    grid.origin[2] + (z + 0.5) * voxel);
    }
    return 0;
}
