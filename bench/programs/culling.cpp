// Gain of tables: frames of the TableRenderer with and without culling points that face away, and of the plain
// renderer.
//
//   bench_culling ROUNDS WIDTH HEIGHT FILE
//
// Without culling every point counts as two-sided. Prints a JSON object: culled, drawn, plain: [round] milliseconds;
// culled_points, drawn_points; table_milliseconds: [round], time to mark the normals that face away, for eight octants;
// other_pixels: part of the pixels that show the model in which tables and plain renderer differ.
#include "pbm_format/reading/load_model.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/tables/facing_table.h"
#include "pbm_render/tables/table_renderer.h"
#include "system/files/mapped_file.h"
#include "value_or_throw.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <functional>
#include <iostream>
#include <stdexcept>
#include <string>

namespace {

using namespace pbm;
using bench::value_or_throw;

double milliseconds(const std::function<void()> &work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double part_of_other_pixels(const Framebuffer &plain, const Framebuffer &tables) {
    double shown = 0, other = 0;
    for (std::size_t i = 0; i < plain.pixels(); ++i) {
        shown += std::isfinite(plain.depth[i]);
        other += plain.colour[i] != tables.colour[i];
    }
    return other / shown;
}

nlohmann::json measure(int rounds, int width, int height, const std::string &file) {
    const MappedFile bytes = value_or_throw(MappedFile::open(file), file);
    Reader reader = value_or_throw(Reader::open(bytes.bytes()), file);
    const Model culled = value_or_throw(load_model(reader), file);
    Model drawn = culled;
    for (std::uint16_t &normal : drawn.levels.back().points.normals)
        normal |= kTwoSidedBit;
    const TableRenderer with(culled), without(drawn);
    const ReferenceRenderer plain(culled);
    const Camera camera = default_camera(culled, width, height);
    Framebuffer target(width, height), plain_target(width, height);
    std::vector<Facing> facing;
    nlohmann::json result;
    for (int round = 0; round < rounds; ++round) {
        result["culled"].push_back(
            milliseconds([&] { result["culled_points"] = with.render(camera, {}, target).drawn_points; }));
        result["plain"].push_back(milliseconds([&] { plain.render(camera, {}, plain_target); }));
        result["other_pixels"] = part_of_other_pixels(plain_target, target);
        result["drawn"].push_back(
            milliseconds([&] { result["drawn_points"] = without.render(camera, {}, target).drawn_points; }));
        result["table_milliseconds"].push_back(milliseconds([&] {
            for (int octant = 0; octant < 8; ++octant)
                mark_facing(camera.position, camera.focal_point, culled.parameters.grid.edge() / 4, facing);
        }));
    }
    return result;
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 5) {
        std::cerr << "usage: bench_culling ROUNDS WIDTH HEIGHT FILE\n";
        return 1;
    }
    try {
        std::cout << measure(std::stoi(argv[1]), std::stoi(argv[2]), std::stoi(argv[3]), argv[4]) << "\n";
    } catch (const std::exception &problem) {
        std::cerr << "bench_culling: " << problem.what() << "\n";
        return 1;
    }
    return 0;
}
