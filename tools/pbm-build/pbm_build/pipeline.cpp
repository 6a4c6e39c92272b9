#include "pbm_build/pipeline.h"

#include "pbm_build/estimate_normals.h"
#include "pbm_build/merge_surfaces.h"
#include "pbm_build/sample_points.h"
#include "pbm_build/splat_radius.h"
#include "pbm_build/vertex_normals.h"
#include "pbm_build/voxelize.h"
#include "pbm_format/parallel.h"
#include "pbm_format/writer.h"
#include "pbm_scan/surface_reader.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace pbm::build {
namespace {

Status check_surface(const Surface &surface) {
    if (surface.positions.empty())
        return Error{ErrorCode::bad_input, 0, "the file has no points: there is nothing to build"};
    if (surface.triangles.empty() && surface.dropped_triangles > 0 && surface.normals.empty())
        return Error{ErrorCode::bad_input, 0,
                     "no face is left: " + std::to_string(surface.dropped_triangles) +
                         " are degenerate or have a corner that is not finite; mend the scan"};
    if (surface.materials.size() > kMaxMaterials)
        return Error{ErrorCode::unsupported_feature, 0,
                     std::to_string(surface.materials.size()) + " materials, a .bvg file holds " +
                         std::to_string(kMaxMaterials) + "; merge some of them"};
    return {};
}

// What the readers left out.
void report_dropped(const Surface &surface, BuildStatistics &statistics) {
    const auto report = [&](const char *name, std::uint64_t count, const char *why) {
        if (count > 0)
            statistics.attributes.push_back(
                {name, AttributeReport::Fate::dropped, std::to_string(count) + std::string(why), surface.name});
    };
    report("vertices", surface.dropped_vertices, " with coordinates that are not finite");
    report("triangles", surface.dropped_triangles, " degenerate, or with a dropped vertex");
}

// Says when the faces have no area, or enclose a negative volume that is large for it. Rooms scanned from within do so
// rightly, so nothing is turned unasked.
void report_winding(const Surface &surface, BuildStatistics &statistics) {
    if (surface.triangles.empty() || !surface.normals.empty())
        return;
    constexpr double kClearlyClosed = 0.01; // a sphere has 0.094
    double volume = 0, area = 0;
    const glm::dvec3 &origin = surface.positions.front();
    for (const glm::uvec3 &t : surface.triangles) {
        const glm::dvec3 a = surface.positions[t.x] - origin, b = surface.positions[t.y] - origin,
                         c = surface.positions[t.z] - origin;
        volume += glm::dot(a, glm::cross(b, c)) / 6;
        area += glm::length(glm::cross(b - a, c - a)) / 2;
    }
    if (!(area > 0))
        statistics.attributes.push_back(
            {"faces", AttributeReport::Fate::kept, "none of them has an area: the model is a line or a point"});
    if (volume < -kClearlyClosed * area * std::sqrt(area))
        statistics.attributes.push_back(
            {"winding", AttributeReport::Fate::kept,
             "the faces point inwards; if the model looks inside out, build it with --flip-faces", surface.name});
}

// Vertices that no triangle uses have no surface to belong to.
Status report_loose_vertices(const Surface &surface, bool strict, BuildStatistics &statistics) {
    if (surface.triangles.empty())
        return {};
    std::vector<bool> used(surface.positions.size(), false);
    for (const glm::uvec3 &t : surface.triangles)
        used[t.x] = used[t.y] = used[t.z] = true;
    const auto loose = std::count(used.begin(), used.end(), false);
    if (loose == 0)
        return {};
    const std::string note =
        std::to_string(loose) + (loose == 1 ? " vertex belongs" : " vertices belong") + " to no face";
    if (strict)
        return Error{ErrorCode::bad_input, 0,
                     "--strict: " + note + "; remove them from the scan or leave --strict out"};
    statistics.attributes.push_back({"loose vertices", AttributeReport::Fate::dropped, note, surface.name});
    return {};
}

Error of_input(const std::string &name, Error error) {
    if (!name.empty())
        error.message = name + ": " + error.message;
    return error;
}

// What there is to say about one input before it is merged with others, and what refuses it.
Status examine(Surface &surface, const BuildOptions &options, BuildStatistics &statistics) {
    statistics.vertices += surface.positions.size();
    statistics.triangles += surface.triangles.size();
    statistics.input_bytes += surface.input_bytes;
    for (AttributeReport &line : surface.report)
        line.input = surface.name;
    statistics.attributes.insert(statistics.attributes.end(), surface.report.begin(), surface.report.end());
    surface.report.clear();
    report_dropped(surface, statistics);
    if (options.flip_faces)
        for (glm::uvec3 &t : surface.triangles)
            std::swap(t.y, t.z);
    report_winding(surface, statistics);
    if (Status checked = check_surface(surface); !checked)
        return checked;
    return report_loose_vertices(surface, options.strict, statistics);
}

// Coordinates of single precision cannot tell places apart that lie closer than their steps.
struct SinglePrecision {
    std::string input;
    double step, near;
};

void report_steps(const std::vector<SinglePrecision> &inputs, double voxel_size, BuildStatistics &statistics) {
    for (const SinglePrecision &input : inputs)
        if (input.step > voxel_size) {
            std::array<char, 256> note{};
            std::snprintf(note.data(), note.size(),
                          "single precision: near %.3g they have steps of %.3g, a voxel has %.3g; export the scan with "
                          "doubles, or shifted to its place, and give the shift as --origin",
                          input.near, input.step, voxel_size);
            statistics.attributes.push_back({"coordinates", AttributeReport::Fate::kept, note.data(), input.input});
        }
}

// Depths to try, finest first, until the voxels are few enough: a surface of area A has at least about A / voxel^2 of
// them.
int finest_depth(const Surface &surface, const Bounds &bounds, std::uint64_t max_points, int threads) {
    int depth = kMaxDepth;
    const double area = relative_area(surface, bounds, threads);
    const auto occupied = occupied_voxels(surface, bounds, threads);
    const auto least = [&] {
        return std::max(std::ldexp(area, 2 * depth), static_cast<double>(occupied[static_cast<std::size_t>(depth)]));
    };
    while (depth > kMinBuildDepth && least() > static_cast<double>(max_points))
        --depth;
    return depth;
}

// The finest of what the triangles and the points ask for.
int chosen_depth(const Surface &surface, const Bounds &bounds, int threads) {
    int depth = kMinBuildDepth;
    if (!surface.triangles.empty())
        depth = std::max(depth, mesh_depth(bounds, median_edge(surface, threads)));
    if (surface.point_count() > 0)
        depth = std::max(depth, point_depth(occupied_voxels(surface, bounds, threads)));
    return depth;
}

Result<Grid> choose_grid(const Surface &surface, const GridRequest &request, int threads) {
    const Bounds bounds = bounds_of(surface);
    Grid grid;
    if (request.voxel_size) {
        auto snapped = snapped_grid(bounds, *request.voxel_size);
        if (!snapped)
            return snapped;
        grid = *snapped;
    } else if (request.depth) {
        grid = centred_grid(bounds, *request.depth);
    } else if (request.max_points) {
        grid = centred_grid(bounds, finest_depth(surface, bounds, *request.max_points, threads));
    } else if (request.like) {
        if (Status fits = check_fits(bounds, *request.like); !fits)
            return fits.error();
        return *request.like;
    } else {
        grid = centred_grid(bounds, chosen_depth(surface, bounds, threads));
    }
    grid.unit = request.unit;
    grid.up = request.up;
    return grid;
}

// Refuses what would run for long only to end in the same error.
Status check_hit_count(const Surface &surface, const Grid &grid, const BuildOptions &options) {
    const Bounds bounds = bounds_of(surface);
    const double edge = centred_grid(bounds, kMinDepth).edge() / grid.voxel_size;
    const double least =
        relative_area(surface, bounds, options.threads) * edge * edge; // a column of voxels per voxel^2 or more
    if (least * sizeof(Hit) <= static_cast<double>(options.max_hit_bytes))
        return {};
    return Error{ErrorCode::memory, 0,
                 "depth " + std::to_string(grid.depth) + " would need at least " +
                     std::to_string(static_cast<std::uint64_t>(least * sizeof(Hit)) >> 20) +
                     " MiB for its samples, the limit is " + std::to_string(options.max_hit_bytes >> 20) +
                     " MiB; choose a smaller --depth, or --max-points"};
}

// Says where the precision of the coordinates, not the scan, sets the size of the voxels.
void report_precision(const Bounds &bounds, const Grid &grid, BuildStatistics &statistics) {
    const double extent = bounds.extent();
    if (!(extent > 0) || grid.edge() <= 2 * extent)
        return;
    std::array<char, 200> note{};
    std::snprintf(note.data(), note.size(),
                  "the scan is %.3g long and lies %.3g from the origin: its grid is %.3g long, finer voxels would be "
                  "below the precision of coordinates; move the scan to its origin",
                  extent, farthest_coordinate(bounds), grid.edge());
    statistics.attributes.push_back({"precision", AttributeReport::Fate::converted, note.data()});
}

AttributeSet choose_attributes(const Surface &surface, ColourFormat colour) {
    AttributeSet set;
    set.colour = surface.colours.empty() ? ColourFormat::none : colour;
    set.material = surface.materials.size() > 1 && !surface.material_ids.empty();
    return set;
}

std::vector<Material> choose_materials(const Surface &surface) {
    std::vector<Material> materials;
    for (const SurfaceMaterial &m : surface.materials)
        materials.push_back({m.ka, m.kd, m.ks, m.power, m.colour, m.environment});
    if (materials.empty())
        materials.emplace_back();
    return materials;
}

// Samples and voxelizes at the depth of `grid`; with --max-points at smaller ones too, until the points are few enough.
Result<Voxels> sample_and_voxelize(const Surface &surface, const VertexNormals &normals, const AttributeSet &set,
                                   Grid &grid, const BuildOptions &options, BuildStatistics &statistics,
                                   StepClock &clock) {
    for (;; grid.depth -= 1, grid.voxel_size *= 2) {
        const bool may_be_coarser = options.grid.max_points.has_value() && grid.depth > kMinBuildDepth;
        if (Status checked = check_hit_count(surface, grid, options); !checked) {
            if (may_be_coarser)
                continue;
            return checked.error();
        }
        const Bytes radii = given_radii(surface, grid);
        const SurfaceSampler sampler(surface, normals, radii, grid, options.threads);
        HitStore hits(grid.depth, resolve_threads(options.threads), options.max_hit_bytes);
        const Status sampled =
            clock.run("sample points", [&](auto progress) { return sample_points(sampler, hits, progress); });
        if (!sampled && sampled.error().code == ErrorCode::memory && may_be_coarser)
            continue;
        if (!sampled)
            return sampled.error();
        statistics.samples = hits.size();
        Voxels voxels = clock.run("voxelize", [&] { return voxelize(sampler, hits, set, options.threads); });
        if (!options.grid.max_points || voxels.codes.size() <= *options.grid.max_points)
            return voxels;
        if (grid.depth == kMinBuildDepth)
            return Error{ErrorCode::usage, 0,
                         "even the coarsest grid has " + std::to_string(voxels.codes.size()) +
                             " points; raise --max-points"};
    }
}

PointRequest point_request(const BuildOptions &options) {
    return {options.viewpoint, options.remove_outliers, options.grid.like ? options.grid.like->up : options.grid.up};
}

// Points may become fewer.
VertexNormals find_normals(Surface &surface, const BuildOptions &options, BuildStatistics &statistics) {
    return estimate_normals(surface, point_request(options), options.threads, statistics);
}

// Radii and the normals that are still missing.
void choose_radii(Voxels &voxels, const Surface &surface, int depth, int threads) {
    fill_normals(voxels, threads);
    if (surface.point_count() > 0)
        radii_from_neighbours(voxels, depth, threads);
    else
        for (std::uint8_t &radius : voxels.points.radii)
            radius = radius_class(radius, depth);
}

} // namespace

Result<Model> build_model(std::vector<Surface> surfaces, const BuildOptions &options, BuildStatistics &statistics,
                          const Progress &progress) {
    StepClock clock(statistics, progress);
    const int threads = options.threads;
    std::vector<SinglePrecision> single_precision;
    for (Surface &surface : surfaces) {
        if (Status good = examine(surface, options, statistics); !good)
            return of_input(surface.name, good.error());
        if (surface.float_step > 0)
            single_precision.push_back({surface.name, surface.float_step, surface.float_near});
    }
    Result<Surface> merged = clock.run("merge", [&] { return merge_surfaces(std::move(surfaces), threads); });
    if (!merged)
        return merged.error();
    Surface &surface = *merged;
    statistics.attributes.insert(statistics.attributes.end(), surface.report.begin(), surface.report.end());
    if (Status bounded = check_bounds(bounds_of(surface)); !bounded)
        return bounded.error();
    const AttributeSet set = choose_attributes(surface, options.colour);
    Result<std::string> metadata =
        make_metadata(options.credits, options.grid, options.placement, point_request(options), set.colour,
                      options.compression_level, options.flip_faces);
    if (!metadata)
        return metadata.error();

    VertexNormals normals = clock.run("normals", [&] { return find_normals(surface, options, statistics); });
    Result<Grid> grid = clock.run("choose grid", [&] { return choose_grid(surface, options.grid, threads); });
    if (!grid)
        return grid.error();
    report_steps(single_precision, grid->voxel_size, statistics);
    if (!options.grid.voxel_size && !options.grid.like)
        report_precision(bounds_of(surface), *grid, statistics);
    Result<Voxels> voxels = sample_and_voxelize(surface, normals, set, *grid, options, statistics, clock);
    if (!voxels)
        return voxels.error();
    if (voxels->codes.size() > kMaxPoints)
        return Error{ErrorCode::too_large, 0,
                     std::to_string(voxels->codes.size()) + " points, a .bvg file holds 2^32 - 1"};
    normals = {};
    clock.run("choose radii", [&] { choose_radii(*voxels, surface, grid->depth, threads); });

    Model model;
    model.parameters = {
        .grid = *grid, .attributes = set, .materials = choose_materials(surface), .lights = {}, .texture = {}};
    model.metadata = std::move(*metadata);
    surface = {};
    clock.run("octree", [&] {
        LevelMasks masks = encode_octree(voxels->codes, grid->depth);
        voxels->codes = {};
        model.levels.resize(masks.size());
        for (std::size_t level = 0; level < masks.size(); ++level)
            model.levels[level].masks = std::move(masks[level]);
        model.levels.back().points = std::move(voxels->points);
    });
    clock.run("detail levels", [&] { average_levels(model, threads); });

    statistics.points = model.point_count();
    statistics.depth = grid->depth;
    statistics.voxel_size = grid->voxel_size;
    for (const std::uint16_t normal : model.levels.back().points.normals)
        statistics.two_sided_points += (normal & kTwoSidedBit) != 0 ? 1 : 0;
    return model;
}

Result<Model> build_model(Surface surface, const BuildOptions &options, BuildStatistics &statistics,
                          const Progress &progress) {
    std::vector<Surface> surfaces;
    surfaces.push_back(std::move(surface));
    return build_model(std::move(surfaces), options, statistics, progress);
}

Result<Model> read_and_build(std::span<const std::string> inputs, const BuildOptions &options,
                             BuildStatistics &statistics, const Progress &progress) {
    std::vector<Surface> surfaces;
    for (const std::string &input : inputs) {
        StepClock clock(statistics, progress);
        const std::string name = inputs.size() > 1 ? name_of(input) : "";
        Result<Surface> surface = clock.run("read", [&](auto read_progress) {
            return read_surface(input,
                                {.strict = options.strict, .format = options.input_format, .progress = read_progress});
        });
        if (!surface)
            return of_input(name, surface.error());
        surface->name = name;
        place(*surface, options.placement);
        surfaces.push_back(std::move(*surface));
    }
    return build_model(std::move(surfaces), options, statistics, progress);
}

Status write(const std::string &output, const Model &model, const BuildOptions &options, BuildStatistics &statistics,
             const Progress &progress) {
    StepClock clock(statistics, progress);
    const Result<std::uint64_t> written = clock.run("write", [&](auto write_progress) {
        return write_model(
            output, model,
            {.compression_level = options.compression_level, .threads = options.threads, .progress = write_progress});
    });
    if (!written)
        return written.error();
    statistics.file_bytes = written.value();
    return {};
}

} // namespace pbm::build
