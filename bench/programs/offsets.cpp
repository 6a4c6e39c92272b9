// Time to estimate surface offsets.
//
//   bench_offsets ROUNDS FILE
//
// Estimates all chunks of the finest level in order, on one thread. Prints a JSON object: points;
// nanoseconds: [round] per point.
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_surface/surface_offsets.h"
#include "system/files/mapped_file.h"
#include "value_or_throw.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <iostream>
#include <span>
#include <stdexcept>
#include <string>

namespace {

using namespace pbm;
using bench::value_or_throw;

nlohmann::json measure(int rounds, const std::string &file) {
    const MappedFile packed = value_or_throw(MappedFile::open(file), file);
    Reader packed_reader = value_or_throw(Reader::open(packed.bytes()), file);
    const Model model = value_or_throw(load_model(packed_reader), file);
    // Only mapped files contain the bricks of chunks.
    const Bytes mapped = value_or_throw(encode_model(model, {.storage = Storage::mapped}), file);
    Reader reader = value_or_throw(Reader::open(mapped), file);
    const LevelDirectory *const finest = value_or_throw(reader.directory(reader.depth()), file);
    std::vector<ChunkView> chunks;
    for (std::size_t i = 0; i < finest->chunks.size(); ++i)
        chunks.push_back(value_or_throw(reader.view_chunk(reader.depth(), i), file));

    nlohmann::json result{{"points", finest->points}};
    SurfaceOffsets estimate;
    std::vector<std::int8_t> offsets(reader.header().chunk_points);
    for (int round = 0; round < rounds; ++round) {
        const auto start = std::chrono::steady_clock::now();
        for (const ChunkView &chunk : chunks)
            estimate.estimate(chunk, std::span(offsets).first(chunk.normals.size()));
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
        result["nanoseconds"].push_back(taken.count() / static_cast<double>(finest->points));
    }
    return result;
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 3) {
        std::cerr << "usage: bench_offsets ROUNDS FILE\n";
        return 1;
    }
    try {
        std::cout << measure(std::stoi(argv[1]), argv[2]) << "\n";
    } catch (const std::exception &problem) {
        std::cerr << "bench_offsets: " << problem.what() << "\n";
        return 1;
    }
    return 0;
}
