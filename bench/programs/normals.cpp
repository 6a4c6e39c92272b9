// bench_normals ROUNDS SCAN: normals of the points or vertices of SCAN, positions alone, in turns with CGAL's; see
// bench/normals.
#include "cgal_peer.h"
#include "pbm_build/normals/estimate_normals.h"
#include "pbm_scan/surface_reader.h"
#include "value_or_throw.h"

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <string>

namespace {

using namespace pbm;
using namespace pbm::build;

// Processor time, since other programs may share the core.
template <class Work> double seconds_of(const Work &work) {
    const std::clock_t start = std::clock();
    work();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

glm::dvec3 vector_from(const ShortNormal &n) { return glm::dvec3(n[0], n[1], n[2]) / kNormalScale; }

// Share of the first `points` points whose normal is on the other side of the true one; zero normals are on neither.
template <class NormalOf>
double wrong_signs(const VertexNormals &truth, std::size_t points, const NormalOf &normal_of) {
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < points; ++i)
        wrong += glm::dot(vector_from(truth.normals[i]), normal_of(i)) < 0 ? 1 : 0;
    return static_cast<double>(wrong) / static_cast<double>(points);
}

nlohmann::json measure(int rounds, const std::string &scan) {
    Surface surface = bench::value_or_throw(read_surface(scan, {}), scan);
    const bool has_truth = !surface.triangles.empty() || !surface.normals.empty();
    Surface bare;
    bare.positions = surface.positions;
    // Splits vertices at creases: the copies come behind all points.
    const VertexNormals truth = bench::value_or_throw(vertex_normals(surface, 1), scan);
    VertexNormals ours;
    std::vector<glm::dvec3> cgal;
    nlohmann::json result{{"points", bare.positions.size()}, {"rounds", nlohmann::json::array()}};
    for (int round = 0; round < rounds; ++round) {
        Surface points = bare;
        PointRequest request;
        request.outliers = Outliers::keep;
        BuildStatistics statistics;
        const double own =
            seconds_of([&] { ours = bench::value_or_throw(estimate_normals(points, request, 1, statistics), scan); });
        const double peer = seconds_of([&] { cgal = bench::cgal_normals(bare.positions); });
        result["rounds"].push_back({{"ours", own}, {"cgal", peer}});
        bare.two_sided = points.two_sided;
    }
    if (has_truth) {
        result["wrong"] = wrong_signs(truth, bare.positions.size(), [&](std::size_t i) {
            return bare.two_sided[i] != 0 ? glm::dvec3(0) : vector_from(ours.normals[i]);
        });
        result["cgal_wrong"] = wrong_signs(truth, bare.positions.size(), [&](std::size_t i) { return cgal[i]; });
    }
    return result;
}

} // namespace

int main(int argc, char **argv) {
    try {
        if (argc != 3 || std::atoi(argv[1]) < 1) {
            std::cerr << "usage: bench_normals ROUNDS SCAN\n";
            return 1;
        }
        std::cout << measure(std::atoi(argv[1]), argv[2]) << "\n";
        return 0;
    } catch (const std::exception &problem) {
        std::cerr << "bench_normals: " << problem.what() << "\n";
        return 1;
    }
}
