// Reads E57 files in memory, of fields of several kinds: points per second of one core, the best of five rounds.
//
//   bench_e57 [THOUSAND_POINTS]
#include "pbm_scan/e57/e57_reader.h"
#include "unit/scan/e57_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace pbm;
using test::E57ScanText;

constexpr std::array<const char *, 3> kAxes{"cartesianX", "cartesianY", "cartesianZ"};
constexpr double kScale = 0.0001; // of integers

E57ScanText with_coordinates(std::size_t points, int bits) {
    E57ScanText scan;
    scan.stream_bytes = 8000;
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
        std::vector<float> floats(points);
        std::vector<std::int64_t> integers(points);
        for (std::size_t i = 0; i < points; ++i) {
            const double place = 30 * std::sin(static_cast<double>(i) * 0.001 + static_cast<double>(axis));
            floats[i] = static_cast<float>(place);
            integers[i] = std::llround(place / kScale);
        }
        const std::int64_t half = std::int64_t{1} << (bits - 1);
        scan.columns.push_back(bits == 0 ? test::e57_floats(kAxes[axis], floats)
                                         : test::e57_integers(kAxes[axis], -half, half - 1, integers,
                                                              "scale=\"" + std::to_string(kScale) + "\""));
    }
    return scan;
}

E57ScanText with_colours(E57ScanText scan) {
    std::vector<std::int64_t> values(scan.columns.front().records);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::int64_t>(i & 255);
    for (const char *name : {"colorRed", "colorGreen", "colorBlue"})
        scan.columns.push_back(test::e57_integers(name, 0, 255, values));
    return scan;
}

void measure(const char *name, const E57ScanText &scan) {
    const std::string file = test::e57_file({scan});
    double best = 1e300;
    for (int round = 0; round < 5; ++round) {
        const auto start = std::chrono::steady_clock::now();
        const auto surface = build::read_e57({reinterpret_cast<const std::uint8_t *>(file.data()), file.size()}, {});
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        if (!surface || surface->positions.size() != scan.columns.front().records)
            throw std::runtime_error("the file is not read");
    }
    const auto points = static_cast<double>(scan.columns.front().records);
    std::printf("%-32s %6.1f M points/s, %5.0f MB/s\n", name, points / best / 1e6,
                static_cast<double>(file.size()) / best / 1e6);
}

void run(std::size_t points) {
    measure("floats", with_coordinates(points, 0));
    measure("floats, colours", with_colours(with_coordinates(points, 0)));
    measure("integers of 32 bits", with_coordinates(points, 32));
    measure("integers of 21 bits", with_coordinates(points, 21));
    measure("integers of 21 bits, colours", with_colours(with_coordinates(points, 21)));
}

} // namespace

int main(int argc, char **argv) {
    std::size_t thousands = 2000;
    if (argc > 1) {
        const std::string_view text = argv[1];
        std::from_chars(text.data(), text.data() + text.size(), thousands);
    }
    try {
        run(thousands * 1000);
        return 0;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bench_e57: %s\n", error.what());
        return 4;
    }
}
