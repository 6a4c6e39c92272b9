#include "ammonite.h"

#include "isosurface.h"
#include "pbm-sample/noise/noise.h"
#include "shell.h"
#include "system/threads/parallel.h"
#include "weathering.h"

#include <cassert>
#include <cmath>
#include <utility>

namespace pbm::sample {

namespace {

constexpr double kMetresPerUnit = 0.095; // radius of the shell at the aperture

// The number of vertices is proportional to area / cell^2. A first, coarse lattice measures it, which predicts the cell
// for the wanted number. A finer lattice resolves slightly more area, hence the correction `extra`.
Isosurface extract_with_vertices(const DistanceField &field, const Box &box, std::size_t wanted, int threads) {
    double cell = 0.014;
    Isosurface surface = extract_isosurface(field, box, cell, threads);
    double extra = wanted > surface.position.size() ? 1.01 : 1.0;
    for (int attempt = 0; attempt < 4; ++attempt) {
        const double error = static_cast<double>(surface.position.size()) / static_cast<double>(wanted);
        if (error > 0.965 && error < 1.035)
            break;
        cell = cell * std::sqrt(error) * extra;
        extra = 1.0;
        surface = Isosurface{};
        surface = extract_isosurface(field, box, cell, threads);
    }
    return surface;
}

// Rotates shell space into model space, a few degrees off every axis.
Vec3 pose(const Vec3 &p) {
    const auto turn = [](double &a, double &b, double turns) {
        const double c = cos_turns(turns), s = sin_turns(turns);
        const double rotated = c * a - s * b;
        b = s * a + c * b;
        a = rotated;
    };
    Vec3 q = p;
    turn(q.x, q.y, 0.012);  // about +Z
    turn(q.z, q.x, 0.021);  // about +Y
    turn(q.y, q.z, -0.014); // about +X: leaning back
    return q * kMetresPerUnit;
}

} // namespace

TriangleMesh make_ammonite(const AmmoniteOptions &options) {
    assert(options.vertices >= kMinVertices && options.vertices <= kMaxVertices);
    const auto seed = static_cast<std::uint32_t>(hash_bits(options.seed));
    const Shell shell(seed);
    const auto begin_stage = [&options](const char *stage) {
        if (options.on_stage)
            options.on_stage(stage);
    };
    begin_stage("growing the shell");
    const DistanceField field = [&shell](const Vec3 &p) { return shell.probe(p).distance; };
    Isosurface surface = extract_with_vertices(field, Shell::bounds(), options.vertices, options.threads);
    keep_largest_piece(surface);

    begin_stage("weathering it");
    TriangleMesh mesh;
    mesh.triangle = std::move(surface.triangle);
    mesh.position = std::move(surface.position);
    mesh.color.resize(mesh.position.size());
    constexpr double kShellArea = 7.5; // shell units squared
    const double spacing = std::sqrt(kShellArea / static_cast<double>(mesh.position.size()));
    parallel_for(mesh.position.size(), 4096, options.threads, [&](std::size_t i) {
        const FinishedVertex v =
            finish_vertex(shell, Vec3(mesh.position[i]), Vec3(surface.normal[i]), spacing, seed, i);
        mesh.position[i] = glm::vec3(pose(v.position));
        mesh.color[i] = v.color;
    });
    return mesh;
}

} // namespace pbm::sample
