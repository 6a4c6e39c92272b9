// Decodes and loads a whole packed model in each round. Built twice: with the library, and with a library without
// checks (CMakeLists.txt), which only bench/checks runs.
//
//   bench_checks MODEL.pbvg ROUNDS
//
// Prints a JSON object: points, `decode` and `load`: [round] in seconds of processor time. "decode": open the file,
// read every directory and decode every chunk into warm memory. "load": load_model. One thread. A first round, not
// counted, warms up.
#include "decode_steps.h"
#include "pbm_format/reading/load_model.h"
#include "system/files/mapped_file.h"

#include <nlohmann/json.hpp>

#include <charconv>
#include <ctime>
#include <iostream>

#include <malloc.h>

namespace {

using namespace pbm;

double processor_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

struct Failure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

int run(const std::string &path, int rounds) {
    // Keeps freed memory in the process, so that later allocations need no new pages.
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        throw Failure(file.error().message);
    bench::WholeDecoder decoder(file->bytes(), 1);
    nlohmann::json decode, load;
    std::uint64_t points = 0;
    for (int round = -1; round < rounds; ++round) {
        const double start = processor_seconds();
        const Result<std::uint64_t> decoded = decoder.run();
        const double between = processor_seconds();
        Result<Reader> reader = Reader::open(file->bytes());
        if (!decoded || !reader)
            throw Failure(path + ": " + (reader ? decoded.error() : reader.error()).message);
        const Result<Model> model = load_model(*reader, {.threads = 1});
        const double end = processor_seconds();
        if (!model || model->point_count() != *decoded)
            throw Failure(path + ": does not load");
        points = *decoded;
        if (round >= 0) {
            decode.push_back(between - start);
            load.push_back(end - between);
        }
    }
    std::cout << nlohmann::json{{"points", points}, {"decode", decode}, {"load", load}}.dump() << '\n';
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    int rounds = 0;
    if (arguments.size() == 2)
        std::from_chars(arguments[1].data(), arguments[1].data() + arguments[1].size(), rounds);
    if (rounds < 1) {
        std::cerr << "usage: bench_checks MODEL.pbvg ROUNDS\n";
        return 1;
    }
    try {
        return run(arguments[0], rounds);
    } catch (const std::exception &error) {
        std::cerr << "bench_checks: " << error.what() << '\n';
        return 3;
    }
}
