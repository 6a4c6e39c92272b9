#include "pbm_build/normals/estimate_normals.h"

#include "pbm_build/grid/far_parts.h"
#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/neighbours/distinct_points.h"
#include "pbm_build/neighbours/outliers.h"
#include "pbm_build/normals/inward_normals.h"
#include "pbm_build/normals/orient_normals.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "system/free_memory.h"

#include <glm/gtc/type_precision.hpp>

#include <algorithm>
#include <array>
#include <utility>

namespace pbm::build {
namespace {

static_assert(kLinks == kSpacingNeighbours, "outliers are found by links");

std::span<const glm::dvec3> places_of(const Surface &surface) {
    return std::span(surface.positions).subspan(surface.first_point());
}

// The lattice, and so the normals, do not depend on the requested depth.
Grid finest_grid(const Surface &surface) { return centred_grid(bounds_of(places_of(surface)), kMaxDepth); }

void drop_points(Surface &surface, const DistinctPoints &points, const Bytes &drop) {
    const std::size_t first = surface.first_point();
    const auto keep = [&](std::size_t i) { return drop[points.place_of[i - first]] == 0; };
    for_vertex_attributes([&](auto &values) { keep_from(values, first, keep); }, surface);
    keep_from(surface.positions, first, keep);
    if (!surface.triangles.empty())
        surface.points_beside_triangles = surface.positions.size() - first;
}

// [places] direction of the sum of the unit vectors of the points at each place.
std::vector<ShortNormal> sums_at_places(std::span<const ShortNormal> of_points, const DistinctPoints &points,
                                        std::size_t places) {
    std::vector<glm::i64vec3> sums(places, glm::i64vec3(0));
    for (std::size_t i = 0; i < of_points.size(); ++i)
        sums[points.place_of[i]] += glm::i64vec3(of_points[i][0], of_points[i][1], of_points[i][2]);
    std::vector<ShortNormal> directions(places);
    for (std::size_t i = 0; i < places; ++i)
        directions[i] = to_short_normal(glm::dvec3(sums[i]));
    return directions;
}

// [places] direction to the scanner that saw each place, of several their sum; zero where its position is not known.
std::vector<ShortNormal> sights_of(const Surface &surface, const DistinctPoints &points, std::size_t places) {
    const std::span<const glm::dvec3> positions = places_of(surface);
    std::vector<ShortNormal> sights(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i)
        if (const std::uint16_t station = surface.station_ids[surface.first_point() + i]; station != kNoStation)
            sights[i] = to_short_normal(surface.stations[station] - positions[i]);
    return sums_at_places(sights, points, places);
}

// Orients the normals that are not given, towards the stations where these are known.
Orientation face_stations(const Surface &surface, const DistinctPoints &points, const PointNeighbours &neighbours,
                          PlaneFits &fits, Bytes is_given, UpAxis up, int threads) {
    const std::vector<ShortNormal> sights = sights_of(surface, points, neighbours.points().size());
    face_scanner(fits.normals, is_given,
                 [&](std::size_t i) { return glm::dvec3(sights[i][0], sights[i][1], sights[i][2]); });
    is_given.resize(sights.size());
    for (std::size_t i = 0; i < sights.size(); ++i)
        if (!is_zero(sights[i]))
            is_given[i] = 1;
    if (std::find(is_given.begin(), is_given.end(), 0) == is_given.end())
        return {Bytes(sights.size()), 0, false};
    return orient_normals(neighbours.points(), fits, is_given, up, threads);
}

double extent_without(const Surface &surface, const DistinctPoints &points, const Bytes &drop) {
    const std::span<const glm::dvec3> places = places_of(surface);
    std::vector<glm::dvec3> kept(places.begin(), places.end());
    keep_from(kept, 0, [&](std::size_t i) { return drop[points.place_of[i]] == 0; });
    return kept.empty() ? 0 : bounds_of(kept).extent();
}

// How many times larger the points to drop make the box of all; 0 if there are no others.
double growth_by(const Surface &surface, const DistinctPoints &points, const Bytes &drop) {
    const double without = extent_without(surface, points, drop);
    return without > 0 ? bounds_of(places_of(surface)).extent() / without : 0;
}

std::string outliers_text(const DistinctPoints &points, const Bytes &outliers) {
    std::uint64_t count = 0;
    for (const std::uint32_t place : points.place_of)
        count += outliers[place];
    return counted(count, "point") + " far from all others";
}

void report_outliers(const Surface &surface, const DistinctPoints &points, const Bytes &outliers, bool dropped,
                     BuildStatistics &statistics) {
    if (std::find(outliers.begin(), outliers.end(), 1) == outliers.end())
        return;
    std::string note = outliers_text(points, outliers);
    if (!dropped)
        note += "; --remove-outliers drops them";
    if (const double growth = growth_by(surface, points, outliers); surface.triangles.empty() && growth > 1.5)
        note += formatted(", which %s the grid %.3g times smaller", dropped ? "makes" : "would make", growth);
    statistics.report(dropped ? Warning::stray_points : Warning::kept_outliers, "outliers", note);
}

// Whether the box of all points is at least kStrayFactor times longer than that of all but a hundredth at each end of
// each axis. Without that there are no strays; their search takes longer.
bool may_have_strays(std::span<const glm::dvec3> places) {
    const Bounds bounds = bounds_of(places);
    const double extent = bounds.extent();
    if (!(extent > 0))
        return false;
    BoxBins counts{};
    for (const glm::dvec3 &place : places) {
        const glm::dvec3 from_corner = (place - bounds.lowest) * (kBoxBins / extent);
        for (int axis = 0; axis < 3; ++axis)
            ++counts[static_cast<std::size_t>(axis)]
                    [std::min(static_cast<std::size_t>(from_corner[axis]), kBoxBins - 1)];
    }
    return bulk_is_small(counts, places.size() / 100);
}

// The places of all points, without their positions, and which of them are outliers.
std::pair<DistinctPoints, Bytes> outliers_of(const Surface &surface, int threads) {
    DistinctPoints points = distinct_points(places_of(surface), finest_grid(surface), threads);
    Bytes outliers = find_outliers(PointNeighbours(std::move(points.at)), threads);
    return {std::move(points), std::move(outliers)};
}

// Drops outliers until they do not make the grid kStrayFactor times larger: nearer strays show only when the farthest
// are gone.
Status drop_strays(Surface &surface, bool strict, int threads, BuildStatistics &statistics) {
    while (surface.triangles.empty() && may_have_strays(places_of(surface))) {
        const auto [points, outliers] = outliers_of(surface, threads);
        const double growth = growth_by(surface, points, outliers);
        if (growth < kStrayFactor)
            break;
        const std::string note =
            outliers_text(points, outliers) +
            formatted(", with which the grid would be %.3g times larger; --keep-outliers keeps them", growth);
        if (strict)
            return bad_input(note);
        statistics.report(Warning::stray_points, "outliers", note);
        drop_points(surface, points, outliers);
    }
    return {};
}

void report_repeated_points(const DistinctPoints &points, BuildStatistics &statistics) {
    const std::uint64_t all = points.place_of.size();
    if (2 * points.repeated >= all)
        statistics.report(Warning::repeated_points, "repeated points",
                          std::to_string(all) + " points lie in " + counted(all - points.repeated, "place") +
                              ", averaged");
}

void remove_outliers(Surface &surface, int threads, BuildStatistics &statistics) {
    const auto [points, outliers] = outliers_of(surface, threads);
    report_outliers(surface, points, outliers, true, statistics);
    drop_points(surface, points, outliers);
}

// `stations`: scanner positions in use.
void report_normals(const PointRequest &request, std::size_t stations, const Orientation &orientation,
                    std::uint64_t given, std::uint64_t estimated, std::uint64_t two_sided,
                    BuildStatistics &statistics) {
    std::string note = std::to_string(kMinNeighbours) + " to " + std::to_string(kMaxNeighbours) + " neighbours, ";
    if (given > 0)
        note = counted(estimated, "point") + " of " + std::to_string(given + estimated) + ", " + note;
    if (request.viewpoint)
        note += "turned to the viewpoint";
    else if (stations > 0)
        note += "turned to " + counted(stations, "scanner position");
    if (!request.viewpoint && (stations == 0 || orientation.pieces > 0))
        note += std::string(stations > 0 ? ", others: " : "") + "orientation by spanning tree, " +
                counted(orientation.pieces, "piece") +
                formatted(", %.1f %% two-sided", 100 * static_cast<double>(two_sided) / static_cast<double>(estimated));
    statistics.report(Warning::estimated_normals, "normals", note);
}

// Makes points round, and reports how many.
void shape_points(Surface &surface, const Bytes &is_round, BuildStatistics &statistics) {
    const auto count = static_cast<std::uint64_t>(std::count(is_round.begin(), is_round.end(), 1));
    if (count == 0)
        return;
    const bool has_room = make_round(surface, is_round);
    const double share = 100 * static_cast<double>(count) / static_cast<double>(is_round.size());
    statistics.report(
        "shape", Fate::estimated,
        formatted("%.1f %% of the points lie on no surface: ", share) +
            (has_room ? "drawn as discs that face the eye" : "drawn as others, there are too many materials"));
}

// Reports options without effect.
void report_unused(const PointRequest &request, bool has_points, BuildStatistics &statistics) {
    if (request.outliers == Outliers::drop && !has_points)
        statistics.report(Warning::idle_option, "--remove-outliers", "there are no points without faces");
    if (request.viewpoint)
        statistics.report(Warning::idle_option, "--viewpoint", "no normal had to be estimated from points");
}

} // namespace

Result<VertexNormals> estimate_normals(Surface &surface, const PointRequest &request, int threads,
                                       BuildStatistics &statistics) {
    const bool has_points = surface.point_count() > 0;
    if (has_points && request.outliers == Outliers::drop)
        remove_outliers(surface, threads, statistics);
    else if (has_points && request.outliers == Outliers::drop_strays)
        if (Status dropped = drop_strays(surface, request.strict, threads, statistics); !dropped)
            return dropped.error();
    Result<VertexNormals> of_faces = vertex_normals(surface, threads);
    if (!of_faces)
        return of_faces;
    free_memory(surface.normals); // they are in the result
    if (!has_points) {
        report_unused(request, false, statistics);
        return of_faces;
    }
    const Grid grid = finest_grid(surface);
    DistinctPoints points = distinct_points(places_of(surface), grid, threads);
    const PointNeighbours neighbours(std::move(points.at));
    const std::size_t places = neighbours.points().size();
    VertexNormals &result = *of_faces;
    const std::span<ShortNormal> normals = std::span(result.normals).subspan(surface.first_point());
    const auto missing = static_cast<std::uint64_t>(std::count_if(normals.begin(), normals.end(), is_zero));
    PlaneFits fits = missing > 0 ? fit_planes(neighbours, threads) : PlaneFits{};
    report_repeated_points(points, statistics);
    if (request.outliers != Outliers::drop)
        report_outliers(surface, points,
                        missing > 0 ? find_outliers(fits.links.spacing, fits.links.nearest)
                                    : find_outliers(neighbours, threads),
                        false, statistics);
    if (missing == 0) {
        report_unused(request, true, statistics);
        if (!request.keep_signs && surface.triangles.empty() && surface.station_ids.empty() &&
            look_inwards(neighbours, sums_at_places(normals, points, places), threads)) {
            for (ShortNormal &normal : normals)
                normal = {static_cast<std::int16_t>(-normal[0]), static_cast<std::int16_t>(-normal[1]),
                          static_cast<std::int16_t>(-normal[2])};
            statistics.report(Warning::turned_normals, "normals",
                              "all of them turned: they pointed into the object; --no-orient-faces keeps them");
        }
        return of_faces;
    }
    Bytes is_given;
    const std::uint64_t given = normals.size() - missing;
    if (given > 0) {
        const std::vector<ShortNormal> kept = sums_at_places(normals, points, places);
        is_given.resize(places);
        for (std::size_t i = 0; i < places; ++i)
            if (!is_zero(kept[i])) {
                fits.normals[i] = kept[i];
                is_given[i] = 1;
            }
    }
    Orientation orientation;
    if (request.viewpoint) {
        orientation.two_sided.resize(places);
        const glm::dvec3 viewpoint =
            (vector_of(*request.viewpoint) - vector_of(grid.origin)) / grid.voxel_size * kLatticeSteps;
        face_scanner(fits.normals, is_given,
                     [&](std::size_t i) { return viewpoint - glm::dvec3(neighbours.points()[i]); });
    } else if (!surface.station_ids.empty()) {
        orientation = face_stations(surface, points, neighbours, fits, is_given, request.up, threads);
    } else {
        orientation = orient_normals(neighbours.points(), fits, is_given, request.up, threads);
    }

    std::uint64_t two_sided = 0;
    surface.two_sided.resize(surface.positions.size());
    const std::vector<Neighbourhood> neighbourhoods =
        classify(fits.links.nearest, kLinks, fits.spreads, orientation.of_body, threads);
    Bytes is_round(normals.size());
    for (std::size_t i = 0; i < normals.size(); ++i)
        if (is_zero(normals[i])) {
            const std::uint32_t place = points.place_of[i];
            is_round[i] = neighbourhoods[place] == Neighbourhood::planar ? 0 : 1;
            normals[i] = fits.normals[place];
            surface.two_sided[surface.first_point() + i] |= orientation.two_sided[place];
            two_sided += orientation.two_sided[place];
        }
    if (missing > given) // else the cloud is a surface that lacks a few normals
        shape_points(surface, is_round, statistics);
    report_normals(request, request.viewpoint ? 0 : surface.stations.size(), orientation, given, missing, two_sided,
                   statistics);
    return of_faces;
}

} // namespace pbm::build
