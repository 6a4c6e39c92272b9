// pbm-sample: makes the project's sample scan, an ammonite, of any size.

#include "pbm-sample/ammonite/ammonite.h"
#include "pbm-sample/ply/ply_writer.h"

#include "command_line/common_options.h"

#include <chrono>
#include <cstdio>
#include <string>

namespace {

struct Arguments {
    pbm::sample::AmmoniteOptions ammonite;
    std::string output;
    bool ascii = false;
    bool quiet = false;
};

int generate(const Arguments &arguments) {
    if (const auto refused = pbm::command_line::refuse_outputs("pbm-sample", {}, {{{"--output", arguments.output}}}))
        return *refused;
    const auto start = std::chrono::steady_clock::now();
    pbm::sample::AmmoniteOptions options = arguments.ammonite;
    const auto seconds = [start] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const auto progress = [&](const char *stage) {
        if (!arguments.quiet && seconds() > 1.0)
            std::fprintf(stderr, "pbm-sample: %5.1f s  %s\n", seconds(), stage);
    };
    options.on_stage = progress;
    const pbm::sample::TriangleMesh mesh = pbm::sample::make_ammonite(options);

    progress("writing");
    const std::string comment = "pbm-sample ammonite --vertices " + std::to_string(options.vertices) + " --seed " +
                                std::to_string(options.seed);
    const auto encoding =
        arguments.ascii ? pbm::sample::PlyEncoding::ascii : pbm::sample::PlyEncoding::binary_little_endian;
    const pbm::Bytes file = pbm::sample::encode_ply(mesh, encoding, comment);
    if (const pbm::Status status = pbm::command_line::write_bytes(arguments.output, file); !status)
        return pbm::command_line::fail("pbm-sample", pbm::command_line::output_name(arguments.output), status.error());
    const std::string done =
        std::to_string(mesh.position.size()) + " vertices, " + std::to_string(mesh.triangle.size()) + " triangles";
    progress(done.c_str());
    return 0;
}

int run(int argc, char **argv) {
    Arguments arguments;
    pbm::command_line::CommandLine line{"pbm-sample",
                                        "Makes a sample scan: a fossil ammonite as a coloured PLY mesh.\n"
                                        "The same vertices and seed give the same bytes on every machine."};
    line.add_version(PBM_VERSION);
    line.add("--vertices", "Wanted number of vertices, met within 5 %", &arguments.ammonite.vertices,
             {.check = pbm::command_line::Integers{pbm::sample::kMinVertices, pbm::sample::kMaxVertices},
              .shows_default = true});
    line.add("--seed", "Another number, another ammonite", &arguments.ammonite.seed, {.shows_default = true});
    pbm::command_line::add_threads(line, arguments.ammonite.threads);
    line.add("--ascii", "Text instead of binary little-endian PLY", &arguments.ascii);
    line.add("-q,--quiet", "Say nothing but errors", &arguments.quiet);
    line.add("-o,--output", "PLY file to write, - for standard output", &arguments.output,
             {.type = "FILE", .required = true});
    if (const auto done = pbm::command_line::parse(
            line, argc, argv, {},
            {.examples = {{"pbm-sample --vertices 1000000 -o scan.ply", "A scan of a million vertices."}}}))
        return *done;
    return generate(arguments);
}

} // namespace

int main(int argc, char **argv) {
    return pbm::command_line::run_program("pbm-sample", [&] { return run(argc, argv); });
}
