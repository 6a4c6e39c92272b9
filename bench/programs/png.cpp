// Writes pictures in each round, in turn with libpng.
//
//   bench_png ROUNDS PICTURE.png...
//
// Prints a JSON array of objects: picture, width, height, opaque, `bytes`: name -> number, `seconds`: name -> [round].
// A first round, not counted, warms up.
#include "png_peer.h"
#include "viewer/pictures/image_writer.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <functional>
#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace pbm;

nlohmann::json measure(const std::string &path, int rounds) {
    const Framebuffer picture = bench::read_png(path);
    const bool opaque =
        std::all_of(picture.colour.begin(), picture.colour.begin() + static_cast<std::ptrdiff_t>(picture.pixels()),
                    [](std::uint32_t pixel) { return pixel >> 24 == 255; });
    const std::vector<std::pair<std::string, std::function<Bytes()>>> writers = {
        {"ours", [&] { return encode_png(picture).value(); }},
        {"ours, 2 threads", [&] { return encode_png(picture, 2).value(); }},
        {"libpng", [&] { return bench::write_png(picture, opaque, false); }},
        {"libpng, fast", [&] { return bench::write_png(picture, opaque, true); }}};
    nlohmann::json bytes, seconds;
    for (int round = -1; round < rounds; ++round)
        for (const auto &[name, write] : writers) {
            const auto start = std::chrono::steady_clock::now();
            const Bytes file = write();
            const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
            bytes[name] = file.size();
            if (round >= 0)
                seconds[name].push_back(time.count());
        }
    return {{"picture", path},  {"width", picture.width},    {"height", picture.height},
            {"opaque", opaque}, {"bytes", std::move(bytes)}, {"seconds", std::move(seconds)}};
}

int run(int argc, char **argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    int rounds = 0;
    if (arguments.size() >= 2)
        std::from_chars(arguments[0].data(), arguments[0].data() + arguments[0].size(), rounds);
    if (rounds < 1) {
        std::cerr << "usage: bench_png ROUNDS PICTURE.png...\n";
        return 1;
    }
    nlohmann::json results = nlohmann::json::array();
    for (std::size_t i = 1; i < arguments.size(); ++i)
        results.push_back(measure(arguments[i], rounds));
    std::cout << results << "\n";
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception &problem) {
        std::cerr << "bench_png: " << problem.what() << "\n";
        return 1;
    }
}
