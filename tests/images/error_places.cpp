#include "error_places.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace pbm {
namespace {

constexpr int kReach = 2; // pixels

// [vertices]: the first vertex at the same position.
std::vector<std::uint32_t> first_at_position(const std::vector<glm::dvec3> &positions) {
    std::map<std::tuple<double, double, double>, std::uint32_t> first;
    std::vector<std::uint32_t> vertices;
    vertices.reserve(positions.size());
    for (const glm::dvec3 &p : positions)
        vertices.push_back(
            first.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(vertices.size())).first->second);
    return vertices;
}

// Calls visit(index) for the pixels of the picture within `reach` of (x, y).
template <class Visit>
void for_pixels_near(const Framebuffer &picture, double x, double y, int reach, const Visit &visit) {
    const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
    for (int v = std::max(row - reach, 0); v <= std::min(row + reach, picture.height - 1); ++v)
        for (int u = std::max(column - reach, 0); u <= std::min(column + reach, picture.width - 1); ++u)
            visit(static_cast<std::size_t>(v) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(u));
}

// [height][width]: whether a visible sharp edge is near.
std::vector<bool> near_edges(std::span<const SharpEdge> edges, const Camera &camera, const std::vector<float> &depths,
                             const Framebuffer &picture) {
    constexpr double kBehind = 1.002; // depth over that of a ray: still visible
    const PixelRays rays(camera, picture.width, picture.height);
    const glm::dvec3 corner = rays.through(0, 0);
    const glm::dmat3 to_pixels =
        glm::inverse(glm::dmat3(rays.through(1, 0) - corner, rays.through(0, 1) - corner, corner));
    const auto project = [&](const glm::dvec3 &place) { // pixel, depth
        const glm::dvec3 image = to_pixels * (place - rays.eye);
        return glm::dvec3(image.x / image.z, image.y / image.z, image.z);
    };
    std::vector<bool> near(depths.size());
    for (const SharpEdge &edge : edges) {
        const glm::dvec3 first = project(edge.from), last = project(edge.to);
        if (first.z <= 0 || last.z <= 0)
            continue;
        const double length = glm::length(glm::dvec2(last) - glm::dvec2(first));
        const int steps = 1 + static_cast<int>(std::min(2 * length, 1e5));
        for (int i = 0; i <= steps; ++i) {
            const glm::dvec3 at = project(edge.from + (edge.to - edge.from) * (static_cast<double>(i) / steps));
            if (std::abs(at.x) > picture.width + kReach || std::abs(at.y) > picture.height + kReach)
                continue;
            bool is_visible = false;
            for_pixels_near(picture, at.x, at.y, 1, [&](std::size_t pixel) {
                is_visible |= at.z < kBehind * static_cast<double>(depths[pixel]);
            });
            if (is_visible)
                for_pixels_near(picture, at.x, at.y, kReach, [&](std::size_t pixel) { near[pixel] = true; });
        }
    }
    return near;
}

// Whether the depths of four pixels in a row jump between the second and the third.
bool jump(const std::vector<float> &depths, std::size_t second, std::size_t step, float pixel) {
    const float middle = std::abs(depths[second + step] - depths[second]);
    const float beside = std::max(std::abs(depths[second] - depths[second - step]),
                                  std::abs(depths[second + 2 * step] - depths[second + step]));
    return std::isfinite(middle) && middle > 3 * beside + 3 * pixel * depths[second];
}

ErrorPlaces::Place place_of(std::size_t at, const std::vector<float> &depths, bool at_edge, float pixel,
                            const Framebuffer &picture) {
    const auto width = static_cast<std::size_t>(picture.width);
    const auto x = static_cast<int>(at % width), y = static_cast<int>(at / width);
    bool misses = false, jumps = false;
    for_pixels_near(picture, x, y, kReach, [&](std::size_t i) { misses |= std::isinf(depths[i]); });
    if (misses)
        return at_edge ? ErrorPlaces::outline_at_edge : ErrorPlaces::outline;
    for_pixels_near(picture, x, y, kReach, [&](std::size_t i) {
        const std::size_t column = i % width, row = i / width;
        if (column >= 1 && row >= 1 && column + 2 < width && row + 2 < static_cast<std::size_t>(picture.height))
            jumps |= jump(depths, i, 1, pixel) || jump(depths, i, width, pixel);
    });
    if (jumps)
        return at_edge ? ErrorPlaces::contour_at_edge : ErrorPlaces::contour;
    return at_edge ? ErrorPlaces::edge : ErrorPlaces::elsewhere;
}

} // namespace

std::vector<SharpEdge> sharp_edges(const TriangleMesh &mesh) {
    struct Faces {
        int count = 0;
        double cosine = 1; // between the normals of the first face and the last
        glm::dvec3 normal{};
    };
    const std::vector<std::uint32_t> vertices = first_at_position(mesh.positions);
    std::map<std::pair<std::uint32_t, std::uint32_t>, Faces> edges;
    for (const glm::uvec3 &t : mesh.triangles) {
        const auto at = [&](int corner) { return mesh.positions[t[corner]]; };
        const glm::dvec3 across = glm::cross(at(1) - at(0), at(2) - at(0));
        if (!(glm::length(across) > 0))
            continue;
        const glm::dvec3 normal = glm::normalize(across);
        for (int corner = 0; corner < 3; ++corner) {
            const auto [from, to] = std::minmax({vertices[t[corner]], vertices[t[(corner + 1) % 3]]});
            Faces &faces = edges[{from, to}];
            if (faces.count++ == 0)
                faces.normal = normal;
            faces.cosine = glm::dot(faces.normal, normal);
        }
    }
    std::vector<SharpEdge> sharp;
    for (const auto &[ends, faces] : edges)
        if (faces.count != 2 || faces.cosine < std::cos(glm::radians(kSharp)))
            sharp.push_back({mesh.positions[ends.first], mesh.positions[ends.second]});
    return sharp;
}

void add_error_places(std::span<const SharpEdge> edges, const Camera &camera, const PictureTruth &truth,
                      std::span<const Srgb> colours, const Framebuffer &drawn, ErrorPlaces &to) {
    const std::vector<float> &depths = truth.rays.depths;
    const std::vector<bool> at_edge = near_edges(edges, camera, depths, drawn);
    const auto pixel = static_cast<float>(2 * std::tan(camera.view_angle / 2) / drawn.height); // at depth 1
    const std::uint32_t nothing = pack_rgba(RenderOptions{}.background) & 0xFFFFFF;
    for (std::size_t i = 0; i < drawn.pixels(); ++i) {
        if (pack_rgb(colours[i]) == nothing && (drawn.colour[i] & 0xFFFFFF) == nothing)
            continue;
        const ErrorPlaces::Place place = place_of(i, depths, at_edge[i], pixel, drawn);
        ++to.pixels[place];
        to.squared_error[place] += squared_difference(colours[i], drawn.colour[i]);
    }
}

std::string to_text(const ErrorPlaces &places) {
    constexpr std::array<const char *, ErrorPlaces::count> kNames{
        "outline", "outline at an edge", "contour", "contour at an edge", "edge", "elsewhere"};
    const auto sum = [](const auto &of) { return std::accumulate(of.begin(), of.end(), std::uint64_t{0}); };
    const std::uint64_t pixels = sum(places.pixels), error = sum(places.squared_error);
    std::string text = "where the error lies   pixels   share %   PSNR without it, dB\n";
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        std::array<char, 120> line{};
        std::snprintf(line.data(), line.size(), "%-20s %9llu %9.1f %9.2f\n", kNames[i],
                      static_cast<unsigned long long>(places.pixels[i]), percent(places.squared_error[i], error),
                      decibels(pixels, error - places.squared_error[i]));
        text += line.data();
    }
    return text;
}

} // namespace pbm
