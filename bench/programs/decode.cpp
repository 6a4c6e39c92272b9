// Each round decodes a whole model, then runs the steps alone, and Draco's decoder on the same voxels.
//
//   bench_decode MODEL.pbvg ROUNDS [FILE.drc...]
//
// Prints a JSON object: points, bytes, `seconds` and `processor_seconds`: name -> [round]. A first round, not
// counted, warms up. One thread except for "decode, 2 threads" and "load, 2 threads". "load": load_model into newly
// allocated memory.
#include "decode_steps.h"
#include "draco_peer.h"
#include "pbm_format/reading/load_model.h"
#include "system/files/mapped_file.h"

#include <nlohmann/json.hpp>

#include <charconv>
#include <chrono>
#include <ctime>
#include <iostream>

#include <malloc.h>

namespace {

using namespace pbm;

struct Failure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

MappedFile open_file(const std::string &path) {
    Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        throw Failure(path + ": " + file.error().message);
    return std::move(file).value();
}

struct Time {
    double seconds = 0, processor_seconds = 0; // processor_seconds: sum over all threads
};

Time time_of(const std::function<void()> &run) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t processor_start = std::clock();
    run();
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
            static_cast<double>(std::clock() - processor_start) / CLOCKS_PER_SEC};
}

void expect_points(std::string_view who, std::uint64_t points, std::uint64_t expected) {
    if (points != expected)
        throw Failure(std::string(who) + " decodes " + std::to_string(points) + " points, not " +
                      std::to_string(expected));
}

// Everything that is timed, in the order of a round.
class Measurement {
  public:
    Measurement(const std::string &path, const std::vector<std::string> &peers) : file_(open_file(path)) {
        Result<Reader> reader = Reader::open(file_.bytes());
        if (!reader)
            throw Failure(path + ": " + reader.error().message);
        reader_ = std::make_unique<Reader>(std::move(reader).value());
        auto directories = bench::open_directories(*reader_);
        if (!directories)
            throw Failure(path + ": " + directories.error().message);
        directories_ = std::move(directories).value();

        for (const int threads : {1, 2}) {
            const std::string suffix = threads == 1 ? "" : ", 2 threads";
            auto decoder = std::make_shared<bench::WholeDecoder>(file_.bytes(), threads);
            items_.push_back({"decode" + suffix, [this, decoder] { decode(*decoder); }});
            items_.push_back({"load" + suffix, [this, threads] { load(threads); }});
        }
        for (bench::Step &step : bench::decoding_steps(file_.bytes(), *reader_, directories_))
            items_.push_back({std::move(step.name), std::move(step.run)});
        for (const std::string &peer : peers) {
            peers_.push_back(std::make_unique<MappedFile>(open_file(peer)));
            items_.push_back({peer, [this, &peer = *peers_.back()] {
                                  expect_points("Draco", bench::decode_draco(peer.bytes()), points());
                              }});
        }
    }

    std::uint64_t points() const { return reader_->header().point_count; }

    nlohmann::json run(int rounds) {
        nlohmann::json seconds, processor_seconds;
        for (int round = -1; round < rounds; ++round)
            for (const bench::Step &item : items_) {
                malloc_trim(0); // returns free pages, so that no item reuses the pages of another
                if (item.name.starts_with("decode"))
                    item.run(); // "decode" is measured in warm memory
                const Time time = time_of(item.run);
                loaded_ = Model();
                if (round >= 0) {
                    seconds[item.name].push_back(time.seconds);
                    processor_seconds[item.name].push_back(time.processor_seconds);
                }
            }
        return {{"points", points()},
                {"bytes", file_.bytes().size()},
                {"seconds", std::move(seconds)},
                {"processor_seconds", std::move(processor_seconds)}};
    }

  private:
    void decode(bench::WholeDecoder &decoder) const {
        const Result<std::uint64_t> decoded = decoder.run();
        if (!decoded)
            throw Failure(decoded.error().message);
        expect_points("the reader", *decoded, points());
    }

    // Keeps the model until the time is taken: freeing it is not part of loading.
    void load(int threads) {
        Result<Reader> reader = Reader::open(file_.bytes());
        Result<Model> model = load_model(reader.value(), {.max_level = kMaxDepth, .threads = threads});
        if (!model)
            throw Failure(model.error().message);
        loaded_ = std::move(model).value();
        expect_points("load_model", loaded_.point_count(), points());
    }

    MappedFile file_;
    std::unique_ptr<Reader> reader_;
    std::vector<const LevelDirectory *> directories_;
    std::vector<std::unique_ptr<MappedFile>> peers_;
    std::vector<bench::Step> items_;
    Model loaded_;
};

int run(int argc, char **argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    int rounds = 0;
    if (arguments.size() >= 2)
        std::from_chars(arguments[1].data(), arguments[1].data() + arguments[1].size(), rounds);
    if (rounds < 1) {
        std::cerr << "usage: bench_decode MODEL.pbvg ROUNDS [FILE.drc...]\n";
        return 1;
    }
    // Keeps freed memory in the process, so that later allocations need no new pages.
    mallopt(M_MMAP_THRESHOLD, 32 << 20);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
    Measurement measurement(arguments[0], {arguments.begin() + 2, arguments.end()});
    std::cout << measurement.run(rounds).dump() << '\n';
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception &error) {
        std::cerr << "bench_decode: " << error.what() << '\n';
        return 3;
    }
}
