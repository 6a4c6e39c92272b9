// Reads scans in memory: points per second of one core, the best of five rounds. Without FILE the scan is a made one of
// a million points in every format, beside its target.
//
//   bench_reading [FILE...]
#include "pbm_scan/surface_reader.h"
#include "unit/scan/e57_files.h"
#include "unit/scan/laz_files.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace pbm;

constexpr std::size_t kSide = 1000, kPoints = kSide * kSide;
constexpr double kUnit = 0.01; // of LAS; of E57 the integers are a hundredth of it

double processor_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Prints a line. `target`: in millions of points per second; 0: none is set. `in_file`: points of the file, if the
// reader merges some; 0: it does not.
void measure(const std::string &name, const std::string &file, const std::string &path, double target,
             std::size_t in_file = 0) {
    double best = 1e300;
    std::size_t points = 0;
    for (int round = 0; round < 5; ++round) {
        const double start = processor_seconds();
        const auto surface = build::read_surface({reinterpret_cast<const std::uint8_t *>(file.data()), file.size()},
                                                 path, {.threads = 1});
        best = std::min(best, processor_seconds() - start);
        if (!surface)
            throw std::runtime_error(name + ": " + surface.error().message);
        points = std::max(in_file, surface->positions.size());
    }
    const double rate = static_cast<double>(points) / best / 1e6;
    std::printf("%-34s %9zu points %7.1f M/s %6.0f MB/s", name.c_str(), points, rate,
                static_cast<double>(file.size()) / best / 1e6);
    if (target > 0)
        std::printf("   target %g: %s", target, rate >= target ? "met" : "NOT MET");
    std::printf("\n");
}

// A hilly place of 100 m, scanned line by line, with noise of a centimetre.
struct Place {
    double x, y, z;
    unsigned red, green, blue, intensity;
};
Place place(std::size_t i) {
    const std::size_t column = i % kSide, line = i / kSide;
    const double x = 0.1 * static_cast<double>(column), y = 0.1 * static_cast<double>(line);
    const auto noise = static_cast<unsigned>(i * 2654435761U >> 7 & 1023U);
    const double z = 8 * std::sin(0.11 * x) * std::cos(0.07 * y) + 0.00002 * noise;
    const auto shade = static_cast<unsigned>(100 + 5 * z) + noise / 64;
    return {.x = x + 0.00001 * noise,
            .y = y,
            .z = z,
            .red = shade,
            .green = shade + 20,
            .blue = shade / 2,
            .intensity = 900 + noise};
}

// Of a format that has colours.
std::vector<std::string> las_points(unsigned format) {
    std::vector<std::string> all;
    std::string record(test::las_record_size(format), '\0');
    for (std::size_t i = 0; i < kPoints; ++i) {
        const Place p = place(i);
        test::put_at<std::int32_t>(record, 0, static_cast<std::int32_t>(std::lround(p.x / kUnit)));
        test::put_at<std::int32_t>(record, 4, static_cast<std::int32_t>(std::lround(p.y / kUnit)));
        test::put_at<std::int32_t>(record, 8, static_cast<std::int32_t>(std::lround(p.z / kUnit)));
        test::put_at<std::uint16_t>(record, 12, static_cast<std::uint16_t>(p.intensity));
        record[14] = format >= 6 ? 0x11 : 0x09; // the only return of a pulse
        record[format >= 6 ? 16 : 15] = static_cast<char>(i / 5000 % 3 + 2);
        test::put_at<double>(record, format >= 6 ? 22 : 20, 1000 + 0.00001 * static_cast<double>(i));
        const std::size_t colour_at = format >= 6 ? 30 : 28;
        test::put_at<std::uint16_t>(record, colour_at, static_cast<std::uint16_t>(256 * p.red));
        test::put_at<std::uint16_t>(record, colour_at + 2, static_cast<std::uint16_t>(256 * p.green));
        test::put_at<std::uint16_t>(record, colour_at + 4, static_cast<std::uint16_t>(256 * p.blue));
        all.push_back(record);
    }
    return all;
}

void measure_las() {
    for (const unsigned format : {3U, 7U}) {
        const std::vector<std::string> points = las_points(format);
        std::string las = test::las_header(format, points[0].size(), kPoints);
        for (const std::string &point : points)
            las += point;
        const std::string name = ", point format " + std::to_string(format);
        measure("LAS" + name, las, "scan.las", 20);
        const test::LazKind kind{.format = format,
                                 .version = format >= 6 ? 3U : 2U,
                                 .chunks = std::vector<unsigned>(20, kPoints / 20),
                                 .are_equal = true};
        measure("LAZ" + name, test::laz_file(kind, points), "scan.laz", 3);
    }
}

// `bits` of scaled integers; 0: floats.
test::E57ScanText e57_scan(int bits, bool has_colours) {
    test::E57ScanText scan;
    scan.stream_bytes = 8000;
    std::vector<float> floats(kPoints);
    std::vector<std::int64_t> integers(kPoints);
    const auto add = [&](const char *name, auto value) {
        for (std::size_t i = 0; i < kPoints; ++i)
            integers[i] = std::llround((floats[i] = static_cast<float>(value(place(i)))) / (0.01 * kUnit));
        const std::int64_t half = std::int64_t{1} << std::max(0, bits - 1);
        scan.columns.push_back(bits == 0 ? test::e57_floats(name, floats)
                                         : test::e57_integers(name, -half, half - 1, integers,
                                                              "scale=\"" + std::to_string(0.01 * kUnit) + "\""));
    };
    add("cartesianX", [](const Place &p) { return p.x; });
    add("cartesianY", [](const Place &p) { return p.y; });
    add("cartesianZ", [](const Place &p) { return p.z; });
    for (const char *name : {"colorRed", "colorGreen", "colorBlue"})
        if (has_colours) {
            for (std::size_t i = 0; i < kPoints; ++i)
                integers[i] = place(i).red;
            scan.columns.push_back(test::e57_integers(name, 0, 255, integers));
        }
    return scan;
}

void measure_e57() {
    for (const bool has_colours : {false, true})
        for (const int bits : {0, 21, 32})
            measure((bits == 0 ? "E57, floats" : "E57, integers of " + std::to_string(bits) + " bits") +
                        (has_colours ? ", colours" : ""),
                    test::e57_file({e57_scan(bits, has_colours)}), "scan.e57", 10);
}

template <class T> void append(std::string &to, T value) {
    to.append(reinterpret_cast<const char *>(&value), sizeof value);
}
void append_place(std::string &to, const Place &p) {
    for (const double coordinate : {p.x, p.y, p.z})
        append(to, static_cast<float>(coordinate));
}

std::string formatted(const char *format, const Place &p, auto... more) {
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(), format, p.x, p.y, p.z, more...);
    return line.data();
}

void measure_tables() {
    std::string pcd = "VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 1000000\n"
                      "HEIGHT 1\nPOINTS 1000000\nDATA binary\n";
    std::string xyz, pts = "1000000\n",
                     ptx = "1000\n1000\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    for (std::size_t i = 0; i < kPoints; ++i) {
        const Place p = place(i);
        append_place(pcd, p);
        append(pcd, p.red << 16 | p.green << 8 | p.blue);
        xyz += formatted("%.4f %.4f %.4f\n", p);
        ptx += formatted("%.4f %.4f %.4f 0.5 %u %u %u\n", p, p.red, p.green, p.blue);
        pts += formatted("%.4f %.4f %.4f %u %u %u %u\n", p, p.intensity, p.red, p.green, p.blue);
    }
    measure("PCD, binary, colours", pcd, "scan.pcd", 30);
    measure("PTX, colours and intensity", ptx, "scan.ptx", 0);
    measure("XYZ, four decimals", xyz, "scan.xyz", 4);
    measure("PTS, colours and intensity", pts, "scan.pts", 0);
}

// The triangles of the grid, by their corners.
template <class Add> void for_each_triangle(const Add &add) {
    for (std::size_t y = 0; y + 1 < kSide; ++y)
        for (std::size_t x = 0; x + 1 < kSide; ++x) {
            const auto at = static_cast<std::uint32_t>(y * kSide + x), above = at + static_cast<std::uint32_t>(kSide);
            add(at, at + 1, above);
            add(above, at + 1, above + 1);
        }
}

std::string glb(std::string vertices, const std::string &indices) {
    const std::string length = std::to_string(vertices.size());
    const std::string counts = std::to_string(indices.size() / 4);
    vertices += indices;
    std::string json =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":)"
        R"([{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":)" +
        std::to_string(kPoints) + R"(,"type":"VEC3"},{"bufferView":1,"componentType":5125,"count":)" + counts +
        R"(,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":)" + length + R"(},{"buffer":0,"byteOffset":)" +
        length + R"(,"byteLength":)" + std::to_string(indices.size()) + R"(}],"buffers":[{"byteLength":)" +
        std::to_string(vertices.size()) + "}]}";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string file = "glTF";
    append(file, std::uint32_t{2});
    append(file, static_cast<std::uint32_t>(28 + json.size() + vertices.size()));
    append(file, static_cast<std::uint32_t>(json.size()));
    file += "JSON" + json;
    append(file, static_cast<std::uint32_t>(vertices.size()));
    return file + std::string("BIN\0", 4) + vertices;
}

void measure_meshes() {
    std::string vertices, indices, obj, off, off_faces, ply_faces, stl(80, '\0'), stl_text = "solid scan\n";
    for (std::size_t i = 0; i < kPoints; ++i) {
        const Place p = place(i);
        append_place(vertices, p);
        off += formatted("%.6g %.6g %.6g\n", p);
        obj += formatted("v %.6g %.6g %.6g\n", p);
    }
    std::uint32_t triangles = 0;
    for_each_triangle([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        ++triangles;
        off_faces += "3 " + std::to_string(a) + ' ' + std::to_string(b) + ' ' + std::to_string(c) + '\n';
        obj += "f " + std::to_string(a + 1) + ' ' + std::to_string(b + 1) + ' ' + std::to_string(c + 1) + '\n';
        ply_faces += '\3';
        for (const std::uint32_t corner : {a, b, c}) {
            append(indices, corner);
            append(ply_faces, corner);
        }
    });
    append(stl, triangles);
    for_each_triangle([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        stl.append(12, '\0');
        stl_text += "facet normal 0 0 1\nouter loop\n";
        for (const std::uint32_t corner : {a, b, c}) {
            append_place(stl, place(corner));
            stl_text += formatted("vertex %.6g %.6g %.6g\n", place(corner));
        }
        stl.append(2, '\0');
        stl_text += "endloop\nendfacet\n";
    });
    const std::string counts = std::to_string(kPoints), faces = std::to_string(triangles);
    measure("GLB", glb(vertices, indices), "scan.glb", 10);
    measure("PLY, binary",
            "ply\nformat binary_little_endian 1.0\nelement vertex " + counts +
                "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
                "\nproperty list uchar int vertex_indices\nend_header\n" + vertices + ply_faces,
            "scan.ply", 0);
    measure("OFF", "OFF\n" + counts + ' ' + faces + " 0\n" + off + off_faces, "scan.off", 5);
    measure("OBJ", obj, "scan.obj", 5);
    const std::size_t corners = 3 * std::size_t{triangles};
    measure("STL, binary, corners", stl, "scan.stl", 5, corners);
    measure("STL, text, corners", stl_text + "endsolid scan\n", "scan.stl", 5, corners);
}

void run(int argc, char **argv) {
    for (int i = 1; i < argc; ++i) {
        std::ifstream file(argv[i], std::ios::binary);
        measure(argv[i], std::string(std::istreambuf_iterator<char>(file), {}), argv[i], 0);
    }
    if (argc > 1)
        return;
    measure_las();
    measure_e57();
    measure_tables();
    measure_meshes();
}

} // namespace

int main(int argc, char **argv) {
    try {
        run(argc, argv);
        return 0;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bench_reading: %s\n", error.what());
        return 4;
    }
}
