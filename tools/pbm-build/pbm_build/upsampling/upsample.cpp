#include "pbm_build/upsampling/upsample.h"

#include "pbm_build/neighbours/distinct_points.h"
#include "pbm_build/neighbours/neighbours.h"
#include "pbm_build/radii/tangent_cell.h"
#include "pbm_build/upsampling/moving_least_squares.h"
#include "pbm_build/voxels/sample.h"
#include "pbm_scan/surface/refusal.h"
#include "system/free_memory.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <tuple>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr std::array<std::size_t, 4> kNear{12, 32, 96, 448}; // neighbours that clip a cell, until it is complete
constexpr std::size_t kSpacing = 8;                          // neighbours whose mean distance is the spacing
constexpr double kStep = 0.5;                                // between the places of a triangle, voxels
constexpr std::size_t kFitted = 48;                          // maximum number of points of a fit
// The points of a fit lie within kAround x the distance of the nearest one and kBeyond spacings.
constexpr double kAround = 2, kBeyond = 1.5;
constexpr double kFade = 1.1; // squared distance at which the weight is 0, over that of the farthest point
constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
static_assert(kNear.back() <= TangentCell::kMaxCuts);

// A point of the scan: what a made point takes from it. Repeated points are one, with their means.
struct CloudPoint {
    glm::dvec3 normal{0}; // unit vector, or zero
    glm::dvec3 colour{0}; // linear light
    double radius = 0;    // 0: none
    bool two_sided = false;
    std::array<std::uint8_t, kByteArrays> bytes{}; // of for_byte_attributes: the largest of repeated points
};

struct MadePoint {
    MortonCode code;                     // its voxel
    double from_centre;                  // squared distance from the voxel's centre
    LatticePoint at;                     //
    ShortNormal normal;                  //
    LinearColour colour;                 //
    float radius;                        //
    std::array<std::uint32_t, 3> places; // the nearest point and two neighbours
    std::array<double, 3> weights;       // of these, sum 1
};

// The distinct positions of a scan's points, with the means of what repeated points have.
struct Cloud {
    std::vector<CloudPoint> places;
    std::vector<MortonCode> occupied; // voxels, ascending
    PointNeighbours neighbours;
    std::vector<std::vector<double>> fields; // [fields][places] the largest value of repeated points; NaN: none
};

Cloud cloud_of(const Surface &surface, const VertexNormals &normals, const Grid &grid, std::size_t field_count,
               int threads) {
    const std::size_t first = surface.first_point();
    DistinctPoints points = distinct_points(std::span(surface.positions).subspan(first), grid, threads);
    std::vector<CloudPoint> places(points.at.size());
    std::vector<double> counts(places.size());
    for (std::size_t i = 0; i < points.place_of.size(); ++i) {
        CloudPoint &place = places[points.place_of[i]];
        const std::size_t vertex = first + i;
        const ShortNormal &normal = normals.normals[vertex];
        place.normal += glm::dvec3(normal[0], normal[1], normal[2]); // integers: in any order
        counts[points.place_of[i]] += 1;
        if (!surface.colours.empty())
            for (int channel = 0; channel < 3; ++channel)
                place.colour[channel] += linear_table()[surface.colours[vertex][static_cast<std::size_t>(channel)]];
        if (!surface.radii.empty())
            place.radius = std::max(place.radius, static_cast<double>(surface.radii[vertex]));
        place.two_sided |= !surface.two_sided.empty() && surface.two_sided[vertex] != 0;
        auto byte = place.bytes.begin();
        for_byte_attributes(
            [&](const auto &values) {
                if (!values.empty())
                    *byte = std::max(*byte, values[vertex]);
                ++byte;
            },
            surface);
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
        places[i].colour /= counts[i];
        if (const double length = glm::length(places[i].normal); length > 0)
            places[i].normal /= length;
    }
    std::vector<std::vector<double>> fields(field_count, std::vector<double>(places.size(), kNoValue));
    for (std::size_t f = 0; f < field_count; ++f)
        for (std::size_t i = 0; i < points.place_of.size(); ++i) {
            double &value = fields[f][points.place_of[i]];
            value = std::fmax(value, surface.field_values[f][first + i].number); // the one that is no NaN
        }
    std::vector<MortonCode> occupied;
    for (const LatticePoint &at : points.at) // along the Morton curve
        if (const MortonCode code = code_of(voxel_of(at)); occupied.empty() || occupied.back() != code)
            occupied.push_back(code);
    return {std::move(places), std::move(occupied), PointNeighbours(std::move(points.at)), std::move(fields)};
}

// Makes points around one point of the cloud after the other.
class GapFiller {
  public:
    GapFiller(const Cloud &cloud, const Grid &grid, int gap)
        : cloud_(cloud), points_(cloud.neighbours.points()), max_circle_(gap / 2.0),
          edge_(1 << (grid.depth + kLatticeBits)), few_(cloud.neighbours), many_(cloud.neighbours),
          fitted_(cloud.neighbours) {}

    void fill_around(std::uint32_t point, std::vector<MadePoint> &made) {
        const CloudPoint &place = cloud_.places[point];
        if (place.normal == glm::dvec3(0))
            return;
        const TangentPlane plane(place.normal);
        candidates_.clear();
        const TangentCell cell = cell_of(point, plane);
        const auto corners = cell.corners();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const int a = corners[i > 0 ? i - 1 : corners.size() - 1].next_edge, b = corners[i].next_edge;
            if (a != 0 && b != 0 && a != b && glm::length(corners[i].at) <= complete_)
                visit_triangle(point, near_[static_cast<std::size_t>(a - 1)].point,
                               near_[static_cast<std::size_t>(b - 1)].point);
        }
        keep_nearest_to_centres();
        for (const Candidate &candidate : candidates_)
            project(point, candidate, made);
    }

  private:
    // A place in an empty voxel on the triangle of a point and two neighbours: point + u (a - point) + v (b - point).
    struct Candidate {
        MortonCode code;
        double from_centre; // as in MadePoint
        glm::dvec3 at;      // lattice
        std::uint32_t a, b;
        double u, v;
    };

    // The Voronoi cell of a point in its tangent plane, in voxels, whose corners are the centres of empty circles.
    TangentCell cell_of(std::uint32_t point, const TangentPlane &plane) {
        for (const std::size_t count : kNear) {
            near_count_ = (count == kNear.front() ? few_ : many_).nearest(point, std::span(near_).first(count));
            TangentCell cell(max_circle_ / 0.92); // so that its sides lie beyond
            for (std::size_t k = 0; k < near_count_; ++k) {
                const glm::dvec3 offset = glm::dvec3(points_[near_[k].point] - points_[point]) / kLatticeSteps;
                const glm::dvec2 flat = plane.flat(offset);
                const double squared = glm::dot(flat, flat);
                if (squared > 1e-6 && is_same_sheet(cosine(cloud_.places[point], cloud_.places[near_[k].point]),
                                                    plane.height(offset), squared))
                    cell.cut(flat, static_cast<int>(k) + 1);
            }
            const bool all = near_count_ < count;
            const double seen =
                near_count_ > 0 ? std::sqrt(near_[near_count_ - 1].squared_distance) / kLatticeSteps : 0;
            complete_ = all ? max_circle_ : std::min(max_circle_, seen / 2);
            double farthest = 0;
            for (const TangentCell::Corner &corner : cell.corners())
                farthest = std::max(farthest, glm::length(corner.at));
            if (all || farthest <= complete_ || complete_ == max_circle_ || count == kNear.back())
                return cell;
        }
        return TangentCell(0); // not reached
    }

    static double cosine(const CloudPoint &p, const CloudPoint &q) {
        const double cosine = glm::dot(p.normal, q.normal);
        return p.two_sided || q.two_sided ? std::fabs(cosine) : cosine;
    }

    void visit_triangle(std::uint32_t point, std::uint32_t a, std::uint32_t b) {
        const glm::dvec3 at(points_[point]), to_a = glm::dvec3(points_[a]) - at, to_b = glm::dvec3(points_[b]) - at;
        const double aa = glm::dot(to_a, to_a), bb = glm::dot(to_b, to_b), ab = glm::dot(to_a, to_b);
        const auto steps =
            static_cast<int>(std::sqrt(std::max({aa, bb, aa + bb - 2 * ab})) / (kStep * kLatticeSteps)) + 1;
        for (int i = 0; i <= steps; ++i)
            for (int j = 0; i + j <= steps; ++j) {
                const double u = static_cast<double>(i) / steps, v = static_cast<double>(j) / steps;
                // Each corner of a triangle visits the places to which it is nearest.
                if (u * aa + v * ab > aa / 2 || u * ab + v * bb > bb / 2)
                    continue;
                const glm::dvec3 place = at + u * to_a + v * to_b;
                if (const MortonCode code = code_of(voxel_of(LatticePoint(place))); !is_occupied(code))
                    candidates_.push_back({code, from_centre(place), place, a, b, u, v});
            }
    }

    bool is_occupied(MortonCode code) const {
        return std::binary_search(cloud_.occupied.begin(), cloud_.occupied.end(), code);
    }
    static double from_centre(const glm::dvec3 &at) {
        const glm::dvec3 voxel = at / kLatticeSteps, offset = voxel - glm::floor(voxel) - 0.5;
        return glm::dot(offset, offset);
    }

    void keep_nearest_to_centres() {
        std::sort(candidates_.begin(), candidates_.end(), [](const Candidate &p, const Candidate &q) {
            return std::tie(p.code, p.from_centre, p.at.x, p.at.y, p.at.z, p.a, p.b) <
                   std::tie(q.code, q.from_centre, q.at.x, q.at.y, q.at.z, q.a, q.b);
        });
        const auto end = std::unique(candidates_.begin(), candidates_.end(),
                                     [](const Candidate &p, const Candidate &q) { return p.code == q.code; });
        candidates_.erase(end, candidates_.end());
    }

    void project(std::uint32_t point, const Candidate &candidate, std::vector<MadePoint> &made) {
        const CloudPoint &place = cloud_.places[point];
        const glm::dvec3 to_point = glm::dvec3(points_[point]) - candidate.at;
        const double distance = glm::length(to_point), reach = kAround * distance + kBeyond * spacing();
        const std::size_t count =
            fitted_.nearest_within(LatticePoint(candidate.at), static_cast<float>(reach * reach), found_);
        if (count == 0)
            return;
        const double farthest = kFade * found_[count - 1].squared_distance, unit = 1 / std::sqrt(farthest);
        std::size_t used = 0;
        for (std::size_t k = 0; k < count; ++k) {
            const CloudPoint &other = cloud_.places[found_[k].point];
            if (!(cosine(place, other) > 0.5))
                continue;
            const glm::dvec3 offset = (glm::dvec3(points_[found_[k].point]) - candidate.at) * unit;
            const double fading = std::max(0.0, 1 - glm::dot(offset, offset));
            const double side = glm::dot(place.normal, other.normal) < 0 ? -1 : 1;
            fit_[used++] = {offset, side * other.normal, fading * fading};
        }
        const auto foot = moving_least_squares(std::span(fit_).first(used));
        if (!foot || glm::length(foot->offset) > distance * unit)
            return;
        const glm::dvec3 at = candidate.at + foot->offset / unit;
        for (int axis = 0; axis < 3; ++axis)
            if (!(at[axis] >= 0 && at[axis] < edge_))
                return;
        const MortonCode code = code_of(voxel_of(LatticePoint(at)));
        if (is_occupied(code))
            return;
        const CloudPoint &a = cloud_.places[candidate.a], &b = cloud_.places[candidate.b];
        const auto mean = [&](const auto &p, const auto &at_a, const auto &at_b) {
            return p + candidate.u * (at_a - p) + candidate.v * (at_b - p);
        };
        const glm::dvec3 colour = mean(place.colour, a.colour, b.colour) + 0.5;
        const bool all_radii = place.radius > 0 && a.radius > 0 && b.radius > 0;
        made.push_back({code,
                        from_centre(at),
                        LatticePoint(at),
                        to_short_normal(foot->normal),
                        {static_cast<std::uint16_t>(colour.x), static_cast<std::uint16_t>(colour.y),
                         static_cast<std::uint16_t>(colour.z)},
                        all_radii ? static_cast<float>(mean(place.radius, a.radius, b.radius)) : 0.0F,
                        {point, candidate.a, candidate.b},
                        {1 - candidate.u - candidate.v, candidate.u, candidate.v}});
    }

    double spacing() const {
        const std::size_t count = std::min(near_count_, kSpacing);
        double sum = 0;
        for (std::size_t k = 0; k < count; ++k)
            sum += std::sqrt(near_[k].squared_distance);
        return sum / static_cast<double>(std::max<std::size_t>(1, count));
    }

    const Cloud &cloud_;
    const std::vector<LatticePoint> &points_;
    double max_circle_; // largest radius of a circle, voxels
    double edge_;       // of the grid, lattice steps
    NeighbourCursor few_, many_, fitted_;
    std::array<NearPoint, kNear.back()> near_{}; // of the current point
    std::size_t near_count_ = 0;
    double complete_ = 0; // circles of this radius, in voxels, are known to be empty
    std::vector<Candidate> candidates_;
    std::array<NearPoint, kFitted> found_{};
    std::array<WeightedPoint, kFitted> fit_{};
};

// Keeps the point of each voxel that is nearest to its centre.
void keep_one_per_voxel(std::vector<MadePoint> &made) {
    std::stable_sort(made.begin(), made.end(), [](const MadePoint &p, const MadePoint &q) {
        return std::tie(p.code, p.from_centre) < std::tie(q.code, q.from_centre);
    });
    const auto end =
        std::unique(made.begin(), made.end(), [](const MadePoint &p, const MadePoint &q) { return p.code == q.code; });
    made.erase(end, made.end());
}

FieldValue field_value(const MadePoint &point, std::span<const double> at_places, FieldAverage average) {
    const double nearest = at_places[point.places[0]];
    if (average != FieldAverage::mean)
        return {nearest};
    double mean = 0;
    for (std::size_t k = 0; k < 3; ++k)
        mean += point.weights[k] * at_places[point.places[k]];
    return {std::isfinite(mean) ? mean : nearest};
}

void append(const std::vector<MadePoint> &made, const Grid &grid, const Cloud &cloud, std::span<const Field> fields,
            Surface &surface, VertexNormals &normals) {
    for_vertex_attributes(
        [&](auto &values) {
            if (!values.empty())
                values.resize(values.size() + made.size(), {});
        },
        surface);
    std::size_t i = surface.positions.size();
    for (const MadePoint &point : made) {
        surface.positions.push_back(vector_of(grid.origin) + glm::dvec3(point.at) * (grid.voxel_size / kLatticeSteps));
        normals.normals.push_back(point.normal);
        if (!surface.normals.empty())
            surface.normals[i] = glm::vec3(point.normal[0], point.normal[1], point.normal[2]);
        if (!surface.colours.empty())
            for (std::size_t channel = 0; channel < 3; ++channel)
                surface.colours[i][channel] = linear_to_srgb(point.colour[channel]);
        if (!surface.radii.empty())
            surface.radii[i] = point.radius;
        auto byte = cloud.places[point.places[0]].bytes.begin();
        for_byte_attributes(
            [&](auto &values) {
                if (!values.empty())
                    values[i] = *byte;
                ++byte;
            },
            surface);
        for (std::size_t f = 0; f < fields.size(); ++f)
            surface.field_values[f][i] = field_value(point, cloud.fields[f], fields[f].average);
        ++i;
    }
    if (!surface.triangles.empty())
        surface.points_beside_triangles += made.size();
}

} // namespace

Result<std::vector<MortonCode>> upsample(Surface &surface, VertexNormals &normals, const Grid &grid,
                                         const UpsampleRequest &request, int threads) {
    const Cloud cloud = cloud_of(surface, normals, grid, request.fields.size(), threads);
    const std::size_t count = cloud.places.size(), blocks = (count + kBlock - 1) / kBlock;
    std::vector<std::vector<MadePoint>> made_in(blocks);
    const std::uint64_t limit = request.max_bytes / (2 * sizeof(MadePoint)); // sorting takes as much again
    std::atomic<std::uint64_t> total{0};
    parallel_blocks(count, kBlock, threads, [&](std::size_t begin, std::size_t end) {
        GapFiller filler(cloud, grid, request.gap);
        std::vector<MadePoint> &made = made_in[begin / kBlock];
        for (std::size_t i = begin; i < end && total.load(std::memory_order_relaxed) <= limit; ++i)
            filler.fill_around(static_cast<std::uint32_t>(i), made);
        keep_one_per_voxel(made);
        made.shrink_to_fit();
        total.fetch_add(made.size(), std::memory_order_relaxed);
    });
    if (total.load() > limit)
        return out_of_memory("--upsample " + std::to_string(request.gap) + " needs more than " +
                             std::to_string(request.max_bytes >> 20) +
                             " MiB for the points that it makes; choose a smaller gap, or a smaller --depth");
    std::vector<MadePoint> made;
    made.reserve(total.load());
    for (std::vector<MadePoint> &some : made_in) {
        made.insert(made.end(), some.begin(), some.end());
        free_memory(some);
    }
    keep_one_per_voxel(made);
    append(made, grid, cloud, request.fields, surface, normals);
    std::vector<MortonCode> filled;
    filled.reserve(made.size());
    for (const MadePoint &point : made)
        filled.push_back(point.code);
    return filled;
}

void remove_made_points(Surface &surface, VertexNormals &normals, std::size_t given) {
    const std::size_t made = surface.positions.size() - given;
    for_vertex_attributes(
        [&](auto &values) {
            if (!values.empty())
                values.resize(given);
        },
        surface);
    surface.positions.resize(given);
    normals.normals.resize(given);
    if (!surface.triangles.empty())
        surface.points_beside_triangles -= made;
}

} // namespace pbm::build
