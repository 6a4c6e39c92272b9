#include "pbm_build/preparing/prepare.h"

#include "pbm_build/grid/far_parts.h"
#include "pbm_build/grid/up_axis.h"
#include "pbm_build/images/image_holes.h"
#include "pbm_build/preparing/examine_surface.h"
#include "pbm_build/preparing/metadata.h"
#include "pbm_build/preparing/poses.h"
#include "pbm_build/surface/corner_tangents.h"
#include "pbm_build/surface/creases.h"
#include "pbm_build/surface/material_colours.h"
#include "pbm_build/surface/merge_surfaces.h"
#include "pbm_scan/conventions/convention.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/surface_reader.h"
#include "system/free_memory.h"

#include <algorithm>

namespace pbm::build {
namespace {

Error with_input_name(const std::string &name, Error error) {
    if (!name.empty())
        error.message = name + ": " + error.message;
    return error;
}

Status repair(Surface &surface, const BuildOptions &options, StepClock &clock, BuildStatistics &statistics) {
    if (surface.triangles.empty())
        return repair_mesh(surface, options.mesh, options.threads, statistics); // has only to say so
    return clock.run("mesh", [&] { return repair_mesh(surface, options.mesh, options.threads, statistics); });
}

// Replaces the scanner positions of each surface by its given viewpoint.
void set_viewpoints(std::vector<Surface> &surfaces, const std::vector<std::array<double, 3>> &viewpoints) {
    for (std::size_t i = 0; i < surfaces.size() && i < viewpoints.size(); ++i) {
        surfaces[i].stations = {vector_of(viewpoints[i])};
        surfaces[i].station_ids.assign(surfaces[i].positions.size(), 0);
    }
}

// Nothing is dropped to make the grid smaller where it is given.
Outliers outliers_of(const BuildOptions &options) {
    const bool grid_is_given = options.grid.like || options.grid.voxel_size;
    return grid_is_given && options.outliers == Outliers::drop_strays ? Outliers::keep : options.outliers;
}

// Images may cut holes into a closed surface, and points may lie beside it.
bool shows_closed_surface(const Surface &surface) {
    return surface.closed && surface.point_count() == 0 &&
           std::all_of(surface.textures.begin(), surface.textures.end(),
                       [](const Texture &texture) { return texture.use.least_opacity == 0; });
}

bool has_materials(const Surface &surface) { return surface.materials.size() > 1 && !surface.material_ids.empty(); }

AttributeSet choose_attributes(const Surface &surface, ColourFormat colour) {
    AttributeSet set;
    const bool is_coloured = !surface.colours.empty() || !surface.texture_ids.empty() || !surface.face_colours.empty();
    set.colour = is_coloured ? colour : ColourFormat::none;
    set.material = has_materials(surface);
    return set;
}

// Chooses the unit and the axis that points up where the user leaves them open: as the format says, else by the shape.
void choose_orientation(const Convention &convention, const Surface &surface, const Bounds &bounds,
                        GridRequest &request, const Run &run) {
    BuildStatistics &statistics = run.statistics;
    if (!request.unit && !convention.unit_reason.empty()) {
        request.unit = convention.unit;
        statistics.report("unit", Fate::kept, std::string(to_string(convention.unit)) + ": " + convention.unit_reason);
    }
    if (request.up)
        return;
    if (!convention.up || !convention.is_firm) {
        const FoundUp found =
            run.clock.run("up axis", [&] { return find_up_axis(surface, bounds, run.options.threads); });
        if (!convention.up || found.overrules(*convention.up)) {
            statistics.report(found.reason == UpReason::none ? Warning::default_up_axis : Warning::estimated_up_axis,
                              "up axis", note_of(found));
            request.up = found.up;
            return;
        }
    }
    request.up = convention.up;
    statistics.report("up axis", Fate::kept, std::string(to_string(*convention.up)) + ": " + convention.up_reason);
}

// Whether its points were measured without faces, colours, normals and materials.
bool is_uncoloured_cloud(const Surface &surface, const AttributeSet &set) {
    return surface.triangles.empty() && surface.normals.empty() && set.colour == ColourFormat::none &&
           std::all_of(surface.materials.begin(), surface.materials.end(),
                       [](const Material &material) { return material == Material(); });
}

} // namespace

Result<std::vector<Surface>> read_surfaces(std::span<const std::string> inputs, const Run &run) {
    const BuildOptions &options = run.options;
    const Result<std::vector<PosedScan>> scans = posed_scans(inputs, options.poses);
    if (!scans)
        return scans.error();
    std::vector<std::string> field_names;
    for (const FieldRequest &field : options.fields)
        field_names.push_back(field.name);
    std::vector<Surface> surfaces;
    for (const PosedScan &scan : *scans) {
        const std::string name = scans->size() > 1 ? name_of(scan.file) : "";
        Result<Surface> surface = run.clock.run("read", [&](auto read_progress) {
            return read_surface(scan.file, {.is_one_of_several = scans->size() > 1,
                                            .is_geographic = options.is_geographic,
                                            .keep_placeholders = options.keep_placeholders,
                                            .flip_green = options.flip_green,
                                            .min_opacity = options.min_opacity,
                                            .strict = options.strict,
                                            .format = options.input_format,
                                            .columns = options.columns,
                                            .fields = field_names,
                                            .usual_fields = usual_fields(options.dropped_fields),
                                            .dropped_classes = options.dropped_classes,
                                            .default_material = options.scene.default_material.value_or(Material{}),
                                            .progress = read_progress,
                                            .threads = options.threads});
        });
        if (!surface)
            return with_input_name(name, surface.error());
        surface->name = name;
        if (scan.pose) {
            pose(*surface, *scan.pose);
            surface->convention.up.reset();
        }
        if (options.placement.scale)
            surface->convention.unit_reason.clear();
        place(*surface, options.placement);
        surfaces.push_back(std::move(*surface));
    }
    return surfaces;
}

Result<Surface> merge_inputs(std::vector<Surface> surfaces, const Run &run) {
    const BuildOptions &options = run.options;
    BuildStatistics &statistics = run.statistics;
    const int threads = options.threads;
    set_materials(surfaces, options.scene, statistics);
    if (options.viewpoints.size() > 1)
        set_viewpoints(surfaces, options.viewpoints);
    for (Surface &surface : surfaces) {
        take_report(surface, statistics);
        if (surface.positions.empty())
            continue;
        if (Status settled = settle_holes(surface, {options.alpha_cutoff, options.strict}, threads, statistics);
            !settled)
            return with_input_name(surface.name, settled.error());
        if (Status repaired = repair(surface, options, run.clock, statistics); !repaired)
            return with_input_name(surface.name, repaired.error());
        if (Status good = examine_surface(surface, options.strict, statistics); !good)
            return with_input_name(surface.name, good.error());
        choose_creases(surface, options.crease_angle, threads, statistics);
    }
    std::erase_if(surfaces, [](const Surface &surface) { return surface.positions.empty(); });
    if (surfaces.empty())
        return bad_input("no input has a point left: there is nothing to build");
    Result<Surface> merged = run.clock.run("merge", [&] { return merge_surfaces(std::move(surfaces), threads); });
    if (!merged)
        return merged;
    Surface &surface = *merged;
    surface.closed = shows_closed_surface(surface);
    colour_by_materials(surface);
    set_image_materials(surface, options.scene, threads, statistics);
    statistics.attributes.insert(statistics.attributes.end(), surface.report.begin(), surface.report.end());
    if (options.flip_green && surface.layer(Layer::normals).ids.empty())
        statistics.report(Warning::idle_option, "--flip-green", "no face has a normal map");
    if (outliers_of(options) != Outliers::keep)
        if (Status dropped = drop_far_parts(surface, options.strict, statistics); !dropped)
            return dropped.error();
    if (Status allowed = refuse_denied(statistics, options.denied); !allowed)
        return allowed.error();
    return merged;
}

Result<Prepared> prepare(std::vector<Surface> surfaces, const Run &run) {
    const BuildOptions &options = run.options;
    BuildStatistics &statistics = run.statistics;
    StepClock &clock = run.clock;
    const int threads = options.threads;
    const Convention convention = common_convention(surfaces);
    std::vector<SinglePrecision> single_precision;
    for (const Surface &surface : surfaces)
        if (surface.float_step > 0 && !surface.positions.empty())
            single_precision.push_back({surface.name, surface.float_step, surface.float_near});
    Result<Surface> merged = merge_inputs(std::move(surfaces), run);
    if (!merged)
        return merged.error();
    Prepared scan;
    scan.surface = std::move(*merged);
    Surface &surface = scan.surface;
    scan.bounds = bounds_of(surface);
    if (Status bounded = check_bounds(scan.bounds); !bounded)
        return bounded.error();
    scan.set = choose_attributes(surface, options.colour);
    Result<std::vector<Field>> fields =
        choose_fields(surface, options.fields, usual_fields(options.dropped_fields), statistics);
    if (!fields)
        return fields.error();
    scan.fields = std::move(*fields);
    Result<Metadata> metadata = make_metadata(options, {.colour = scan.set.colour,
                                                        .is_uncoloured_cloud = is_uncoloured_cloud(surface, scan.set),
                                                        .crs = surface.crs,
                                                        .views = surface.views,
                                                        .part_names = surface.part_names});
    if (!metadata)
        return metadata.error();
    scan.metadata = std::move(metadata->text);
    if (!surface.crs.empty())
        statistics.report("coordinate reference system", metadata->has_crs ? Fate::kept : Fate::dropped,
                          metadata->has_crs ? "in the metadata, as \"crs\"" : "the metadata has no room for it");

    const auto report_room = [&](const char *name, std::size_t kept, std::size_t all) {
        if (kept < all)
            statistics.report(name, Fate::dropped,
                              "the metadata has room for " + std::to_string(kept) + " of " + std::to_string(all));
    };
    report_room("further cameras", metadata->views, surface.views.size());
    report_room("further names of nodes", metadata->part_names, surface.part_names.size());

    GridRequest request = options.grid;
    request.scan_bytes = statistics.input_bytes;
    if (!request.like)
        choose_orientation(convention, surface, scan.bounds, request, run);
    const PointRequest points{.viewpoint = options.viewpoints.size() == 1 ? std::optional(options.viewpoints.front())
                                                                          : std::nullopt,
                              .outliers = outliers_of(options),
                              .strict = options.strict,
                              .keep_signs = options.mesh.winding.keep,
                              .up = request.like ? request.like->up : *request.up};
    Result<VertexNormals> estimated =
        clock.run("normals", [&] { return estimate_normals(surface, points, threads, statistics); });
    if (!estimated)
        return estimated.error();
    scan.normals = std::move(*estimated);
    scan.normals.tangents = corner_tangents(surface, scan.normals.normals, scan.normals.faces_point_inward, threads);
    free_memory(surface.tangents);
    scan.set.material = has_materials(surface);
    free_memory(surface.station_ids);
    if (surface.point_count() > 0)
        scan.bounds = bounds_of(surface);
    Result<ChosenGrid> chosen = clock.run(
        "choose grid", [&] { return choose_grid(surface, scan.bounds, scan.normals.normals, request, threads); });
    if (!chosen)
        return chosen.error();
    if (!chosen->reason.empty())
        statistics.report(Warning::finer_grid, "depth", chosen->reason);
    scan.grid = chosen->grid;
    report_steps(single_precision, scan.grid.voxel_size, statistics);
    if (!options.grid.voxel_size && !options.grid.like)
        report_precision(scan.bounds, scan.grid, statistics);
    if (Status allowed = refuse_denied(statistics, options.denied); !allowed)
        return allowed.error();
    return scan;
}

} // namespace pbm::build
