#include "pbm_build/hole_filling/hole_triangulation.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>

namespace pbm::build {
namespace {

constexpr double kImpossible = std::numeric_limits<double>::infinity();

// The best triangulation of the section of the hole from vertex i to vertex k.
struct Section {
    double bend = kImpossible; // the largest: 1 - cosine of the angle between normals
    double area = 0;
    glm::dvec3 normal{0};   // of the face at edge i-k
    std::uint32_t apex = 0; // of that face
};

double bend_at(const glm::dvec3 &normal, const glm::dvec3 &other) {
    return other == glm::dvec3(0) ? 0 : 1 - glm::dot(normal, other);
}

class Triangulation {
  public:
    explicit Triangulation(const Rim &rim) : rim_(rim), count_(rim.vertices.size()), sections_(count_ * count_) {
        for (std::size_t i = 0; i + 1 < count_; ++i)
            store(i, i + 1, {.bend = 0, .normal = rim.vertices[i].face_normal});
        for (std::size_t length = 2; length < count_; ++length)
            for (std::size_t i = 0; i + length < count_; ++i)
                store(i, i + length, best_section(i, i + length));
    }

    std::optional<std::vector<PatchTriangle>> triangles() const {
        std::vector<PatchTriangle> triangles;
        std::vector<std::array<std::size_t, 2>> open{{0, count_ - 1}};
        while (!open.empty()) {
            const auto [i, k] = open.back();
            open.pop_back();
            if (k - i < 2)
                continue;
            const Section &part = sections_[i * count_ + k];
            if (part.bend == kImpossible)
                return std::nullopt;
            triangles.push_back({static_cast<std::uint32_t>(i), part.apex, static_cast<std::uint32_t>(k)});
            open.push_back({part.apex, k});
            open.push_back({i, part.apex});
        }
        return triangles;
    }

  private:
    // In both places, so that the loop over apexes reads two rows.
    void store(std::size_t i, std::size_t k, const Section &part) {
        sections_[i * count_ + k] = sections_[k * count_ + i] = part;
    }

    Section best_section(std::size_t i, std::size_t k) const {
        Section best;
        const bool is_whole = k - i + 1 == count_;
        const std::array chord{static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k)};
        if (!is_whole && std::binary_search(rim_.chords.begin(), rim_.chords.end(), chord))
            return best;
        const glm::dvec3 &from = rim_.vertices[i].position, edge = rim_.vertices[k].position - from;
        for (std::size_t apex = i + 1; apex < k; ++apex) {
            const Section &left = sections_[i * count_ + apex], &right = sections_[k * count_ + apex];
            const double least = std::max(left.bend, right.bend);
            if (least > best.bend || least == kImpossible)
                continue;
            const glm::dvec3 cross = glm::cross(rim_.vertices[apex].position - from, edge);
            const double length = glm::length(cross), area = left.area + right.area + length / 2;
            if (!(length > 0) || (least == best.bend && area >= best.area))
                continue;
            const glm::dvec3 normal = cross / length;
            double bend = std::max({least, bend_at(normal, left.normal), bend_at(normal, right.normal)});
            if (is_whole)
                bend = std::max(bend, bend_at(normal, rim_.vertices[k].face_normal));
            if (bend < best.bend || (bend == best.bend && area < best.area))
                best = {bend, area, normal, static_cast<std::uint32_t>(apex)};
        }
        return best;
    }

    const Rim &rim_;
    std::size_t count_;
    std::vector<Section> sections_; // [count][count]
};

} // namespace

std::optional<std::vector<PatchTriangle>> triangulate_hole(const Rim &rim) {
    if (rim.vertices.size() < 3)
        return std::nullopt;
    return Triangulation(rim).triangles();
}

} // namespace pbm::build
