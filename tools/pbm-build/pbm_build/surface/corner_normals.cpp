#include "pbm_build/surface/corner_normals.h"

#include "pbm_build/surface/face_normal.h"
#include "pbm_build/surface/faces_of_vertices.h"
#include "pbm_scan/surface/refusal.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 16384;
constexpr std::size_t kBatches = 4;       // of vertices, which bounds the memory for the faces at each vertex
constexpr double kUnit = 1 << 20;         // of a unit normal
constexpr double kAreaUnit = 0x1p45;      // of the squared longest edge of the box around all vertices
constexpr double kRoundingDegrees = 0.05; // an edge of exactly the crease angle is a crease

// Faces of one smoothing group that meet at 150 degrees or more are the seam of two windings: their sum has no
// direction.
constexpr double kOpposite = -0.866 * kUnit * kUnit;

struct Face {
    glm::ivec3 normal{}; // in kUnit; zero without an area
    float area = 0;      // of its plane's connected faces, in kAreaUnit; 0 for a needle
};

double longest_edge_of_box(const Surface &surface) {
    glm::dvec3 lowest = surface.positions.front(), highest = lowest;
    for (const glm::dvec3 &p : surface.positions) {
        lowest = glm::min(lowest, p);
        highest = glm::max(highest, p);
    }
    const glm::dvec3 size = highest - lowest;
    return std::max({size.x, size.y, size.z});
}

// Thin for its length, and thinner than 2^-14 of the box: rounding to single precision or to five decimals turns it by
// degrees. `area`: twice the triangle's.
bool is_needle(double area, const std::array<glm::dvec3, 3> &corners, double box) {
    double longest = 0; // squared
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec3 edge = corners[(i + 1) % 3] - corners[i];
        longest = std::max(longest, glm::dot(edge, edge));
    }
    return 128 * area < longest && 0x1p28 * area * area < box * box * longest;
}

std::vector<Face> faces_of(const Surface &surface, int threads) {
    const double box = longest_edge_of_box(surface);
    std::vector<Face> faces(surface.triangles.size());
    parallel_for(faces.size(), kBlock, threads, [&](std::size_t i) {
        const glm::uvec3 &t = surface.triangles[i];
        const std::array<glm::dvec3, 3> corners{surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]};
        const glm::dvec3 n = face_normal(corners[0], corners[1], corners[2]);
        const double length = glm::length(n);
        if (!(length > 0))
            return;
        Face &face = faces[i];
        for (int axis = 0; axis < 3; ++axis)
            face.normal[axis] = static_cast<int>(n[axis] / length * kUnit + std::copysign(0.5, n[axis]));
        if (!is_needle(length, corners, box))
            face.area = static_cast<float>(length / 2 / box / box * kAreaUnit);
    });
    return faces;
}

constexpr double kOnePlane = 0.999 * kUnit * kUnit; // least cosine: that of small angles is too coarse to tell more

bool in_one_plane(const glm::dvec3 &a, const glm::dvec3 &b) {
    if (glm::dot(a, b) < kOnePlane)
        return false;
    static const double limit = std::pow(std::sin(glm::radians(kPlanarDegrees)) * kUnit * kUnit, 2);
    const glm::dvec3 across = glm::cross(a, b);
    return glm::dot(across, across) <= limit;
}

double crease_cosine(double angle) {
    return std::cos(std::max(0.0, angle - glm::radians(kRoundingDegrees))) * kUnit * kUnit;
}

// Sums of areas are integers, so that they do not depend on the order; they saturate.
std::uint64_t sum_of_areas(std::uint64_t sum, float area) {
    return std::min(sum + static_cast<std::uint64_t>(area), std::uint64_t{1} << 62);
}

// The faces at one vertex, in the order of their indices.
struct Fan {
    std::span<const std::uint32_t> faces;
    std::vector<glm::dvec3> normals{};   // of length kUnit
    std::vector<float> areas{};          // of their planes; 0 where the face does not count
    std::vector<std::uint32_t> groups{}; // for smoothing; empty: the angle decides

    void fill(std::span<const std::uint32_t> indices, const std::vector<Face> &all, const Surface &surface) {
        faces = indices;
        normals.resize(indices.size());
        areas.resize(indices.size());
        groups.clear();
        for (std::size_t i = 0; i < indices.size(); ++i) {
            const Face &face = all[indices[i]];
            normals[i] = glm::dvec3(face.normal);
            areas[i] = face.area;
        }
        for (std::size_t i = 0; i < indices.size() && !surface.smoothing_groups.empty(); ++i)
            groups.push_back(surface.smoothing_groups[indices[i]]);
    }
    bool counts(std::size_t i) const { return areas[i] > 0; }
    // Whether two faces share a normal at the vertex; `cosine`: of the crease angle.
    bool are_smooth(std::size_t i, std::size_t j, double cosine) const {
        const double along = glm::dot(normals[i], normals[j]);
        if (groups.empty() || (groups[i] | groups[j]) == 0)
            return along > cosine;
        return groups[i] == groups[j] && groups[i] != Surface::kFlat && along > kOpposite;
    }
};

bool dominates(float large, float small) { return large > static_cast<float>(kDominantArea) * small; }

// Faces that share a vertex and a plane.
using FacePair = std::pair<std::uint32_t, std::uint32_t>;

// Appends those of a fan to `pairs`. Returns whether the vertex is smooth: no two faces meet at a crease.
bool add_planar_pairs(const Fan &fan, double cosine, std::vector<FacePair> &pairs) {
    if (fan.faces.size() > kMaxFacesAtVertex)
        return false;
    double lowest = kUnit * kUnit;
    for (std::size_t i = 0; i < fan.faces.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const double along = glm::dot(fan.normals[i], fan.normals[j]);
            lowest = std::min(lowest, along);
            if (along >= kOnePlane && in_one_plane(fan.normals[i], fan.normals[j]))
                pairs.emplace_back(fan.faces[i], fan.faces[j]);
        }
    if (fan.groups.empty() && lowest > cosine) // whichever faces count
        return true;
    for (std::size_t i = 0; i < fan.faces.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (fan.counts(i) && fan.counts(j) && !fan.are_smooth(i, j, cosine))
                return false;
    return true;
}

// Calls work(batch, first, end) for batches of `count` vertices, several at once.
template <class Work> void for_batches(std::size_t count, int threads, const Work &work) {
    parallel_for(kBatches, threads, [&](std::size_t batch) {
        const std::size_t first = count * batch / kBatches, end = count * (batch + 1) / kBatches;
        if (first < end)
            work(batch, first, end);
    });
}

using PairsOfBatches = std::array<std::vector<FacePair>, kBatches>;

// Calls use(batch, vertex, fan) for each vertex with faces.
template <class Use>
void for_fans(const Surface &surface, const std::vector<Face> &faces, int threads, const Use &use) {
    for_batches(surface.positions.size(), threads, [&](std::size_t batch, std::size_t first, std::size_t end) {
        const FacesOfVertices at(surface, first, end, [](std::size_t) { return true; });
        Fan fan;
        for (std::size_t vertex = first; vertex < end; ++vertex) {
            fan.fill(at.at(vertex), faces, surface);
            if (!fan.faces.empty())
                use(batch, vertex, fan);
        }
    });
}

// The share of the area whose faces have a neighbour in the same plane.
double share_in_planes(const Surface &surface, const std::vector<Face> &faces, const PairsOfBatches &pairs) {
    std::vector<bool> is_planar(faces.size());
    for (const std::vector<FacePair> &some : pairs)
        for (const auto &[a, b] : some) {
            const glm::uvec3 &t = surface.triangles[a], &u = surface.triangles[b];
            int common = 0;
            for (int corner = 0; corner < 3; ++corner)
                common += t[corner] == u.x || t[corner] == u.y || t[corner] == u.z ? 1 : 0;
            if (common >= 2)
                is_planar[a] = is_planar[b] = true;
        }
    std::uint64_t planar = 0, all = 0;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        all = sum_of_areas(all, faces[i].area);
        planar = sum_of_areas(planar, is_planar[i] ? faces[i].area : 0);
    }
    return all > 0 ? static_cast<double>(planar) / static_cast<double>(all) : 0;
}

// Replaces the area of each face by that of all faces that `pairs` connect with it.
void sum_areas_of_planes(std::vector<Face> &faces, const PairsOfBatches &pairs) {
    std::vector<std::uint32_t> parents(faces.size());
    std::iota(parents.begin(), parents.end(), 0U);
    const auto root_of = [&](std::uint32_t i) {
        while (parents[i] != i)
            i = parents[i] = parents[parents[i]];
        return i;
    };
    for (const std::vector<FacePair> &some : pairs)
        for (const auto &[a, b] : some)
            parents[root_of(a)] = root_of(b);
    std::unordered_map<std::uint32_t, std::uint64_t> areas; // by root
    for (std::uint32_t i = 0; i < faces.size(); ++i)
        if (const std::uint32_t root = root_of(i); root != i) {
            std::uint64_t &sum = areas.try_emplace(root, sum_of_areas(0, faces[root].area)).first->second;
            sum = sum_of_areas(sum, faces[i].area);
        }
    for (std::uint32_t i = 0; i < faces.size(); ++i)
        if (const auto plane = areas.find(root_of(i)); plane != areas.end() && faces[i].area > 0)
            faces[i].area = static_cast<float>(plane->second);
}

// A new vertex, and the corners that take it in place of the old one.
struct Copy {
    std::uint32_t vertex;
    ShortNormal normal;
};
struct Move {
    std::uint32_t triangle, vertex; // the old one
    std::size_t copy;               // of its block
};
struct Splits {
    std::vector<Copy> copies;
    std::vector<Move> moves;
};

// Computes the normals of corners, one vertex after the other. For one thread.
class CornerNormals {
  public:
    // `has_planes`: whether planes count once and may dominate.
    CornerNormals(const Surface &surface, const FacesOfVertices &at, const std::vector<Face> &faces, double cosine,
                  double sign, bool has_planes)
        : surface_(surface), at_(at), faces_(faces), cosine_(cosine), sign_(sign), has_planes_(has_planes) {}

    // Returns the vertex's normal, and appends to `splits` the corners that differ from it.
    ShortNormal at(std::size_t vertex, Splits &splits) {
        fan_.fill(at_.at(vertex), faces_, surface_);
        const bool is_hub = fan_.faces.size() > kMaxFacesAtVertex;
        if (!is_hub)
            count_faces_of_planes();
        const std::size_t first = splits.copies.size();
        ShortNormal of_vertex{};
        for (std::size_t i = 0; i < fan_.faces.size(); ++i) {
            const ShortNormal normal = is_hub ? direction(fan_.normals[i]) : corner(i);
            if (i == 0)
                of_vertex = normal;
            if (normal == of_vertex)
                continue;
            std::size_t copy = is_hub ? splits.copies.size() : first;
            while (copy < splits.copies.size() && splits.copies[copy].normal != normal)
                ++copy;
            if (copy == splits.copies.size())
                splits.copies.push_back({static_cast<std::uint32_t>(vertex), normal});
            splits.moves.push_back({fan_.faces[i], static_cast<std::uint32_t>(vertex), copy});
        }
        return of_vertex;
    }

  private:
    ShortNormal direction(const glm::dvec3 &sum) const { return to_short_normal(sign_ * sum); }

    void count_faces_of_planes() {
        in_plane_.assign(fan_.faces.size(), 1);
        for (std::size_t i = 0; i < fan_.faces.size() && has_planes_; ++i)
            for (std::size_t j = 0; j < fan_.faces.size(); ++j)
                in_plane_[i] += i != j && fan_.counts(j) && in_one_plane(fan_.normals[i], fan_.normals[j]) ? 1 : 0;
    }

    // Of face i of the fan.
    ShortNormal corner(std::size_t i) const {
        float largest = 0;
        const auto is_near = [&](std::size_t j) {
            return fan_.counts(j) && (i == j || fan_.are_smooth(i, j, cosine_));
        };
        for (std::size_t j = 0; j < fan_.faces.size(); ++j)
            if (is_near(j))
                largest = std::max(largest, fan_.areas[j]);
        glm::dvec3 sum(0), all(0);
        for (std::size_t j = 0; j < fan_.faces.size(); ++j) {
            if (!fan_.counts(j))
                continue;
            const glm::dvec3 vote = glm::round(fan_.normals[j] / in_plane_[j]);
            all += vote;
            if (is_near(j) && (!has_planes_ || !dominates(largest, fan_.areas[j])))
                sum += vote;
        }
        if (sum == glm::dvec3(0)) // a needle, or without an area
            sum = all == glm::dvec3(0) ? fan_.normals[i] : all;
        return direction(sum);
    }

    const Surface &surface_;
    const FacesOfVertices &at_;
    const std::vector<Face> &faces_;
    double cosine_, sign_;
    bool has_planes_;
    Fan fan_;
    std::vector<double> in_plane_; // [faces of the fan] how many of them count and lie in its plane
};

// Appends the copies to the vertices with triangles, and gives the moved corners to them.
Status split_vertices(Surface &surface, std::vector<ShortNormal> &normals, const std::array<Splits, kBatches> &blocks) {
    std::size_t count = 0;
    for (const Splits &block : blocks)
        count += block.copies.size();
    if (count == 0)
        return {};
    if (surface.positions.size() + count >= std::numeric_limits<std::uint32_t>::max())
        return too_large("more than 2^32 - 2 vertices, copies at creases included; split the scan, or build it with "
                         "--crease-angle 180");
    const std::size_t end = surface.first_point();
    std::vector<std::uint32_t> vertices; // of the copies
    vertices.reserve(count);
    for (const Splits &block : blocks) {
        for (const Move &move : block.moves) {
            glm::uvec3 &t = surface.triangles[move.triangle];
            for (int corner = 0; corner < 3; ++corner)
                if (t[corner] == move.vertex)
                    t[corner] = static_cast<std::uint32_t>(end + vertices.size() + move.copy);
        }
        for (const Copy &copy : block.copies)
            vertices.push_back(copy.vertex);
    }
    const auto insert = [&](auto &values) {
        if (values.empty())
            return;
        values.insert(values.begin() + static_cast<std::ptrdiff_t>(end), count, {});
        for (std::size_t i = 0; i < count; ++i)
            values[end + i] = values[vertices[i]];
    };
    insert(surface.positions);
    for_vertex_attributes(insert, surface);
    insert(normals);
    std::size_t next = end;
    for (const Splits &block : blocks)
        for (const Copy &copy : block.copies)
            normals[next++] = copy.normal;
    return {};
}

} // namespace

Status add_corner_normals(Surface &surface, std::vector<ShortNormal> &normals, double sign, int threads) {
    const double scanned = crease_cosine(surface.crease_angle.value_or(glm::radians(kScannedCrease)));
    std::vector<Face> faces = faces_of(surface, threads);
    const std::size_t count = normals.size();
    enum State : std::uint8_t { is_given, is_smooth, is_creased };
    Bytes states(count, is_given);
    PairsOfBatches pairs;
    for_fans(surface, faces, threads, [&](std::size_t batch, std::size_t vertex, const Fan &fan) {
        const bool smooth = add_planar_pairs(fan, scanned, pairs[batch]);
        if (!is_zero(normals[vertex]))
            return;
        states[vertex] = smooth ? is_smooth : is_creased;
        if (smooth)
            normals[vertex] =
                to_short_normal(sign * std::accumulate(fan.normals.begin(), fan.normals.end(), glm::dvec3(0)));
    });
    const bool has_planes = share_in_planes(surface, faces, pairs) >= kMinPlanarShare;
    if (has_planes)
        sum_areas_of_planes(faces, pairs);
    const double cosine =
        has_planes ? crease_cosine(surface.crease_angle.value_or(glm::radians(kConstructedCrease))) : scanned;
    const std::uint8_t least = has_planes ? is_smooth : is_creased;
    std::array<Splits, kBatches> splits;
    for_batches(count, threads, [&](std::size_t batch, std::size_t first, std::size_t end) {
        const FacesOfVertices at(surface, first, end, [&](std::size_t i) { return states[i] >= least; });
        CornerNormals corners(surface, at, faces, cosine, sign, has_planes);
        for (std::size_t vertex = first; vertex < end; ++vertex)
            if (states[vertex] >= least)
                normals[vertex] = corners.at(vertex, splits[batch]);
    });
    return split_vertices(surface, normals, splits);
}

double planar_share(const Surface &surface, int threads) {
    const std::vector<Face> faces = faces_of(surface, threads);
    PairsOfBatches pairs;
    for_fans(surface, faces, threads,
             [&](std::size_t batch, std::size_t, const Fan &fan) { add_planar_pairs(fan, 0, pairs[batch]); });
    return share_in_planes(surface, faces, pairs);
}

} // namespace pbm::build
