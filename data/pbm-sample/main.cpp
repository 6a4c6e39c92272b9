// pbm-sample: makes sample scans of any size: an ammonite as a mesh, a terrain and a statue as points.

#include "pbm-sample/ammonite/ammonite.h"
#include "pbm-sample/ply/ply_stream.h"
#include "pbm-sample/ply/ply_writer.h"
#include "pbm-sample/points/statue.h"
#include "pbm-sample/points/terrain.h"

#include "command_line/common_options.h"
#include "system/files/file_replacement.h"

#include <chrono>
#include <cstdio>
#include <optional>
#include <string>

namespace {

enum class Shape { ammonite, terrain, statue };

struct Arguments {
    Shape shape = Shape::ammonite;
    pbm::sample::AmmoniteOptions ammonite;
    std::optional<std::uint64_t> vertices, points;
    bool normals = false;
    std::string output;
    bool ascii = false;
    bool quiet = false;

    pbm::sample::PlyEncoding encoding() const {
        return ascii ? pbm::sample::PlyEncoding::ascii : pbm::sample::PlyEncoding::binary_little_endian;
    }
};

// Says how long the program has run and what it does, once that takes more than a second.
class Progress {
  public:
    explicit Progress(bool quiet) : quiet_(quiet) {}
    void operator()(const std::string &stage) const {
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
        if (!quiet_ && seconds > 1.0)
            std::fprintf(stderr, "pbm-sample: %5.1f s  %s\n", seconds, stage.c_str());
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    bool quiet_;
};

int finish(const Arguments &arguments, const pbm::Status &status) {
    if (!status)
        return pbm::command_line::fail("pbm-sample", pbm::command_line::output_name(arguments.output), status.error());
    return 0;
}

int generate_ammonite(const Arguments &arguments) {
    const Progress progress(arguments.quiet);
    pbm::sample::AmmoniteOptions options = arguments.ammonite;
    options.vertices = arguments.vertices.value_or(options.vertices);
    options.on_stage = progress;
    const pbm::sample::TriangleMesh mesh = pbm::sample::make_ammonite(options);

    progress("writing");
    const std::string comment = "pbm-sample ammonite --vertices " + std::to_string(options.vertices) + " --seed " +
                                std::to_string(options.seed);
    const pbm::Bytes file = pbm::sample::encode_ply(mesh, arguments.encoding(), comment);
    const int code = finish(arguments, pbm::command_line::write_bytes(arguments.output, file));
    if (code == 0)
        progress(std::to_string(mesh.position.size()) + " vertices, " + std::to_string(mesh.triangle.size()) +
                 " triangles");
    return code;
}

pbm::Status write_points(const Arguments &arguments, const pbm::sample::PointScan &scan,
                         const pbm::sample::PointPlyOptions &options) {
    pbm::Result<pbm::FileReplacement> file = pbm::FileReplacement::begin(arguments.output);
    if (!file)
        return file.error();
    const auto write = [&file](pbm::ByteView bytes) { return file->write(bytes); };
    if (pbm::Status status = pbm::sample::stream_ply(scan, options, write); !status)
        return status;
    return file->finish(pbm::Durability::cached);
}

int generate_points(const Arguments &arguments) {
    const Progress progress(arguments.quiet);
    const std::uint64_t points = arguments.points.value_or(1'000'000);
    const std::uint32_t seed = arguments.ammonite.seed;
    const bool is_terrain = arguments.shape == Shape::terrain;
    const pbm::sample::PointScan scan =
        is_terrain ? pbm::sample::make_terrain(points, seed) : pbm::sample::make_statue(points, seed);
    const std::string comment = "pbm-sample --shape " + std::string(is_terrain ? "terrain" : "statue") + " --points " +
                                std::to_string(points) + " --seed " + std::to_string(seed);
    const int code = finish(arguments, write_points(arguments, scan,
                                                    {.encoding = arguments.encoding(),
                                                     .normals = arguments.normals,
                                                     .comment = comment,
                                                     .threads = arguments.ammonite.threads}));
    if (code == 0)
        progress(std::to_string(points) + " points");
    return code;
}

int generate(const Arguments &arguments) {
    const bool is_mesh = arguments.shape == Shape::ammonite;
    if (is_mesh && (arguments.points || arguments.normals))
        return pbm::command_line::fail_usage("pbm-sample", std::string(arguments.points ? "--points" : "--normals") +
                                                               " needs --shape terrain or statue");
    if (!is_mesh && arguments.vertices)
        return pbm::command_line::fail_usage("pbm-sample", "--vertices is for the ammonite; write --points");
    if (const auto refused = pbm::command_line::refuse_outputs("pbm-sample", {}, {{{"--output", arguments.output}}}))
        return *refused;
    return is_mesh ? generate_ammonite(arguments) : generate_points(arguments);
}

int run(int argc, char **argv) {
    Arguments arguments;
    pbm::command_line::CommandLine line{"pbm-sample", "Makes sample scans of any size as coloured PLY.\n"
                                                      "The same options give the same bytes on every machine."};
    line.add_version(PBM_VERSION);
    pbm::command_line::add_choice<Shape>(
        line, "--shape", "shape",
        {{"ammonite", Shape::ammonite}, {"terrain", Shape::terrain}, {"statue", Shape::statue}}, arguments.shape,
        "A fossil as a mesh (default); as points, a valley seen from the air or a marble statue");
    line.add("--vertices", "Wanted vertices of the ammonite, met within 5 %; default 1000000", &arguments.vertices,
             {.check = pbm::command_line::Integers{pbm::sample::kMinVertices, pbm::sample::kMaxVertices}});
    line.add("--points", "Exact number of points of a terrain or statue; default 1000000", &arguments.points,
             {.check = pbm::command_line::Integers{1, pbm::sample::kMaxPoints}});
    line.add("--normals", "Points carry normals", &arguments.normals);
    line.add("--seed", "Another number, another specimen", &arguments.ammonite.seed, {.shows_default = true});
    pbm::command_line::add_threads(line, arguments.ammonite.threads);
    line.add("--ascii", "Text instead of binary little-endian PLY", &arguments.ascii);
    line.add("-q,--quiet", "Say nothing but errors", &arguments.quiet);
    line.add("-o,--output", "PLY file to write, - for standard output", &arguments.output,
             {.type = "FILE", .required = true});
    if (const auto done = pbm::command_line::parse(
            line, argc, argv, {},
            {.examples = {{"pbm-sample --vertices 1000000 -o scan.ply", "A scan of a million vertices."},
                          {"pbm-sample --shape terrain --points 1000000000 -o land.ply",
                           "15 GB of points, in constant memory."}}}))
        return *done;
    return generate(arguments);
}

} // namespace

int main(int argc, char **argv) {
    return pbm::command_line::run_program("pbm-sample", [&] { return run(argc, argv); });
}
