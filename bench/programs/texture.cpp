// bench_texture ROUNDS: evaluation speed of solid textures on one core; see bench/texture.
#include "pbm_build/panorama/default_panorama.h"
#include "pbm_build/texture/solid_texture.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <functional>
#include <vector>

namespace {

using namespace pbm;

// The voxels that a sphere's surface enters, in Morton order.
std::vector<MortonCode> sphere_codes(int depth) {
    const std::int64_t edge = std::int64_t{1} << depth;
    std::vector<MortonCode> codes;
    for (std::int64_t z = 0; z < edge; ++z)
        for (std::int64_t y = 0; y < edge; ++y)
            for (std::int64_t x = 0; x < edge; ++x) {
                const auto offset = [edge](std::int64_t at) { return 2 * at + 1 - edge; };
                const std::int64_t squared = offset(x) * offset(x) + offset(y) * offset(y) + offset(z) * offset(z);
                const std::int64_t radius = edge * 9 / 10;
                if (squared > (radius - 2) * (radius - 2) && squared <= radius * radius)
                    codes.push_back(morton_encode(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                                  static_cast<std::uint32_t>(z)));
            }
    std::sort(codes.begin(), codes.end());
    return codes;
}

// Processor time, since other programs may share the core.
double seconds_of(const std::function<void()> &work) {
    const std::clock_t start = std::clock();
    work();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void measure(int round_count) {
    constexpr int kDepth = 9;
    const std::vector<MortonCode> codes = sphere_codes(kDepth);
    const Grid grid{.depth = kDepth, .origin = {}};
    Bytes values(codes.size());
    nlohmann::json rounds = nlohmann::json::array();
    for (int round = 0; round < round_count; ++round) {
        nlohmann::json seconds;
        for (const TextureKind kind : {TextureKind::marble, TextureKind::wood}) {
            const auto texture = build::make_texture({.kind = kind});
            const char *const name = kind == TextureKind::marble ? "marble" : "wood";
            seconds[name] = seconds_of([&] { build::evaluate_texture(*texture, grid, codes, values, 1); });
        }
        seconds["panorama"] =
            seconds_of([] { static_cast<void>(build::default_panorama(build::kDefaultPanoramaWidth, 1)); });
        rounds.push_back(seconds);
    }
    std::printf("%s\n", nlohmann::json{{"points", codes.size()}, {"rounds", rounds}}.dump().c_str());
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 2)
        return 1;
    try {
        measure(std::atoi(argv[1]));
    } catch (const std::exception &failure) {
        std::fprintf(stderr, "bench_texture: %s\n", failure.what());
        return 4;
    }
    return 0;
}
