// Drawing speed of each splat shape, with random normals and places.
//
//   bench_splats ROUNDS WIDTH HEIGHT RADIUS...
//
// Shapes: pixel, square, kernel (the dissertation's table, including the lookup), ellipse (the exact image of the disc,
// computed for every splat). RADIUS: pixels; a square's is half its edge.
// Prints a JSON array, an object for each shape and radius: shape, radius, splats_per_second: [round], and for kernels
// table_milliseconds: [round], time to compute the table.
#include "pbm_format/model/normal.h"
#include "pbm_render/camera/normal_table.h"
#include "pbm_render/tables/splat_blocks.h"
#include "pbm_render/tables/splat_kernels.h"

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <chrono>
#include <functional>
#include <iostream>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace pbm;

constexpr std::size_t kSplats = 20000;
constexpr double kFront = 9, kRear = 11; // depths

struct Point {
    std::size_t normal;
    glm::vec2 pixel;
    float depth;
};

// Points that face the eye, at random places of the picture.
std::vector<Point> make_points(const Projection &projection, int width, int height) {
    std::mt19937 random(1);
    const auto below = [&](double end) { return static_cast<float>(std::uniform_real_distribution<>(0, end)(random)); };
    std::vector<Point> points;
    while (points.size() < kSplats) {
        const std::size_t normal = std::uniform_int_distribution<std::size_t>(0, kNormalCount - 1)(random);
        const Point point{normal, {below(width), below(height)}, static_cast<float>(kFront) + below(kRear - kFront)};
        const UnitVector &n = normal_table()[normal];
        if (glm::dot(projection.ray(point.pixel), glm::dvec3(n[0], n[1], n[2])) < 0)
            points.push_back(point);
    }
    return points;
}

void draw_square(const Point &point, float radius, std::uint32_t index, Framebuffer &target) {
    const int left = std::max(0, static_cast<int>(point.pixel.x - radius + 0.5F)),
              right = std::min(target.width, static_cast<int>(point.pixel.x + radius + 0.5F)),
              top = std::max(0, static_cast<int>(point.pixel.y - radius + 0.5F)),
              bottom = std::min(target.height, static_cast<int>(point.pixel.y + radius + 0.5F));
    for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x)
            if (const auto at = static_cast<std::size_t>(std::ptrdiff_t{y} * target.width + x);
                point.depth < target.depth[at]) {
                target.depth[at] = point.depth;
                target.colour[at] = index;
            }
}

double seconds(const std::function<void()> &work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

nlohmann::json measure(int rounds, int width, int height, const std::vector<float> &radii) {
    Camera camera;
    camera.position = {0, 0, (kFront + kRear) / 2};
    const Projection projection(camera, width, height);
    const std::vector<ScreenNormal> normals = transform_normals(projection);
    const std::vector<Point> points = make_points(projection, width, height);
    Framebuffer target(width, height);
    const auto draw_all = [&](auto &&draw) {
        target.clear({});
        return static_cast<double>(points.size()) / seconds([&] {
                   for (std::size_t i = 0; i < points.size(); ++i)
                       draw(points[i], static_cast<std::uint32_t>(i));
               });
    };
    nlohmann::json results = nlohmann::json::array();
    for (const float radius : radii) {
        nlohmann::json pixel, square, kernel, ellipse, table;
        for (int round = 0; round < rounds; ++round) {
            std::optional<SplatKernels> kernels;
            table.push_back(1e3 * seconds([&] { kernels.emplace(projection, width, height, kFront, kRear); }));
            pixel.push_back(draw_all(
                [&](const Point &p, std::uint32_t i) { kernels->draw(p.normal, p.pixel, p.depth, 1, i, target); }));
            square.push_back(draw_all([&](const Point &p, std::uint32_t i) { draw_square(p, radius, i, target); }));
            kernel.push_back(draw_all([&](const Point &p, std::uint32_t i) {
                kernels->draw(p.normal, p.pixel, p.depth, radius, i, target);
            }));
            ellipse.push_back(draw_all([&](const Point &p, std::uint32_t i) {
                const ScreenNormal &normal = normals[p.normal];
                const float size = radius * p.depth / static_cast<float>(projection.focal);
                const float facing = glm::dot(normal.plane, glm::vec3(p.pixel, 1));
                draw_splat<false>(
                    BlockShape(project_splat(projection, normal, p.pixel, facing, {size, size / 0.87F, false})),
                    {p.pixel, p.depth, 1 / p.depth, i}, target);
            }));
        }
        const auto add = [&](const char *shape, const nlohmann::json &rates) {
            results.push_back({{"shape", shape}, {"radius", radius}, {"splats_per_second", rates}});
        };
        add("pixel", pixel);
        add("square", square);
        add("kernel", kernel);
        results.back()["table_milliseconds"] = table;
        add("ellipse", ellipse);
    }
    return results;
}

} // namespace

int main(int argc, char **argv) {
    if (argc < 5) {
        std::cerr << "usage: bench_splats ROUNDS WIDTH HEIGHT RADIUS...\n";
        return 1;
    }
    std::vector<float> radii;
    for (int i = 4; i < argc; ++i)
        radii.push_back(std::stof(argv[i]));
    std::cout << measure(std::stoi(argv[1]), std::stoi(argv[2]), std::stoi(argv[3]), radii) << "\n";
    return 0;
}
