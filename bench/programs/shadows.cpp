// Bakes shadows in each round, in turn with Embree's shadow rays, and counts the points where they differ.
//
//   bench_shadows ROUNDS MAPS MODEL.pbvg MESH
//
// Prints a JSON object: points, prepare_ns (of ShadowCasters, per point, [round]), and for each of four lights: name,
// facing, lit, false_shadow, false_light, wrong, wrong_light, strictly_wrong, bake_ns (per point, [round]), embree_ns
// (per ray, [round]); rays_wrong, rays_strictly_wrong, rays_ns: with rays against the triangles, as pbm-build bakes
// meshes; triangles, prepare_rays_ns (tree and places, per point, [round]). One thread. A first round, not counted,
// warms up.
#include "pbm_bake/shadow_baker.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_scan/surface_reader.h"
#include "shadow_truth.h"
#include "system/files/mapped_file.h"
#include "value_or_throw.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <chrono>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace pbm;
using bench::value_or_throw;

constexpr std::size_t kSamples = 200000;

std::array<float, 3> floats(const glm::dvec3 &v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

struct NamedLight {
    std::string name;
    Light light;
};

// A key light from the upper left front, a grazing light, and a point and a spot light about a radius away.
std::vector<NamedLight> lights_around(const TriangleMesh &mesh, const Grid &grid) {
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const glm::dvec3 &position : mesh.positions) {
        low = glm::min(low, position);
        high = glm::max(high, position);
    }
    const glm::dvec3 centre = (low + high) / 2.0 - glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]);
    const double radius = glm::length(high - low) / 2;
    const auto directional = [](const glm::dvec3 &direction) {
        return Light{.kind = LightKind::directional, .direction = floats(glm::normalize(direction))};
    };
    const glm::dvec3 spot = centre + glm::dvec3(-1.2, 0.6, 1.3) * radius;
    return {{"key", directional({0.5, -0.7, -0.5})},
            {"grazing", directional({-1, -0.2, -0.35})},
            {"point", {.kind = LightKind::point, .position = floats(centre + glm::dvec3(0.9, 1.1, 0.8) * radius)}},
            {"spot",
             {.kind = LightKind::spot,
              .position = floats(spot),
              .direction = floats(glm::normalize(centre - spot)),
              .exponent = 8}}};
}

template <class Work> double seconds(Work &&work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Nanoseconds per shadow ray, over all places that face the light.
double cast_rays(const ShadowTruth &truth, const SampledPoints &sample, const Grid &grid, const Light &light) {
    std::size_t rays = 0, reached = 0;
    const double time = seconds([&] {
        for (const SurfacePlace &place : sample.places) {
            const glm::dvec3 start = place.position + place.normal * (kTruthLift * grid.voxel_size);
            const TowardsLight way = towards_light(light, grid, start);
            if (glm::dot(place.normal, way.direction) <= 0)
                continue;
            ++rays;
            reached += truth.reaches(start, way.direction, way.distance) ? 1 : 0;
        }
    });
    return reached <= rays ? 1e9 * time / static_cast<double>(rays) : 0;
}

nlohmann::json measure(int rounds, int maps, const std::string &model_file, const std::string &mesh_file) {
    const MappedFile file = value_or_throw(MappedFile::open(model_file), model_file);
    Reader reader = value_or_throw(Reader::open(file.bytes()), model_file);
    const Model model = value_or_throw(load_model(reader), model_file);
    const build::Surface surface = value_or_throw(build::read_surface(mesh_file, build::ReadOptions{}), mesh_file);
    const TriangleMesh mesh{surface.positions, surface.triangles};
    const Grid &grid = model.parameters.grid;
    const ShadowTruth truth(mesh, glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) + grid.edge() / 2);
    const std::size_t points = model.point_count();
    const SampledPoints sample = sample_model(truth, model, std::max<std::size_t>(1, points / kSamples), 0);
    const std::vector<NamedLight> lights = lights_around(mesh, grid);

    nlohmann::json result{
        {"points", points}, {"depth", grid.depth}, {"maps", maps}, {"lights", nlohmann::json::array()}};
    std::vector<nlohmann::json> bake_ns(lights.size()), embree_ns(lights.size());
    std::vector<Bytes> baked(lights.size());
    const ShadowOptions options{.maps = maps, .threads = 1};
    const auto triangle = [&](std::size_t i) {
        const auto corner = [&](unsigned position) {
            const glm::dvec3 p =
                (mesh.positions[position] - glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2])) /
                grid.voxel_size;
            return Position(floats(p));
        };
        const glm::uvec3 &corners = mesh.triangles[i];
        return TriangleTree::Triangle{corner(corners.x), corner(corners.y), corner(corners.z)};
    };
    result["triangles"] = mesh.triangles.size();
    std::vector<nlohmann::json> rays_ns(lights.size());
    std::vector<Bytes> by_rays(lights.size());
    for (int round = -1; round < rounds; ++round) {
        std::unique_ptr<ShadowCasters> casters;
        const double prepared = seconds([&] { casters = std::make_unique<ShadowCasters>(model, 1); });
        std::unique_ptr<TriangleTree> tree;
        std::unique_ptr<ShadowRays> rays;
        const double prepared_rays = seconds([&] {
            tree = std::make_unique<TriangleTree>(mesh.triangles.size(), triangle, 1);
            rays = std::make_unique<ShadowRays>(*casters, *tree, 1);
        });
        if (!rays->complete())
            throw std::runtime_error("not all points of the model lie on a triangle of " + mesh_file);
        if (round >= 0) {
            result["prepare_ns"].push_back(1e9 * prepared / static_cast<double>(points));
            result["prepare_rays_ns"].push_back(1e9 * prepared_rays / static_cast<double>(points));
        }
        for (std::size_t l = 0; l < lights.size(); ++l) {
            const double time = seconds([&] { baked[l] = bake_light(*casters, lights[l].light, options); });
            const double ray = cast_rays(truth, sample, grid, lights[l].light);
            const double own = seconds(
                [&] { by_rays[l] = bake_light(*casters, lights[l].light, {.rays = rays.get(), .threads = 1}); });
            if (round >= 0) {
                bake_ns[l].push_back(1e9 * time / static_cast<double>(points));
                embree_ns[l].push_back(ray);
                rays_ns[l].push_back(1e9 * own / static_cast<double>(points));
            }
        }
    }
    for (std::size_t l = 0; l < lights.size(); ++l) {
        const ShadowFigures figures = compare_shadows(truth, sample, grid, lights[l].light, baked[l], 0);
        const ShadowFigures exact = compare_shadows(truth, sample, grid, lights[l].light, by_rays[l], 0);
        result["lights"].push_back({{"name", lights[l].name},
                                    {"facing", figures.facing},
                                    {"lit", figures.lit},
                                    {"false_shadow", figures.false_shadow},
                                    {"false_light", figures.false_light},
                                    {"wrong", figures.wrong()},
                                    {"wrong_light", figures.wrong_light()},
                                    {"strictly_wrong", figures.strictly_wrong()},
                                    {"bake_ns", bake_ns[l]},
                                    {"embree_ns", embree_ns[l]},
                                    {"rays_wrong", exact.wrong()},
                                    {"rays_strictly_wrong", exact.strictly_wrong()},
                                    {"rays_ns", rays_ns[l]}});
    }
    return result;
}

int run(const std::vector<std::string> &arguments) {
    if (arguments.size() != 4) {
        std::cerr << "usage: bench_shadows ROUNDS MAPS MODEL.pbvg MESH\n";
        return 1;
    }
    std::cout << measure(std::stoi(arguments[0]), std::stoi(arguments[1]), arguments[2], arguments[3]) << "\n";
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    try {
        return run({argv + 1, argv + argc});
    } catch (const std::exception &problem) {
        std::cerr << "bench_shadows: " << problem.what() << "\n";
        return 1;
    }
}
