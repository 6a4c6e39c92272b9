#include "pbm_build/pipeline.h"

#include "pbm_build/grid/examine_surface.h"
#include "pbm_build/grid/far_parts.h"
#include "pbm_build/grid/poses.h"
#include "pbm_build/grid/up_axis.h"
#include "pbm_build/metadata.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_build/surface/creases.h"
#include "pbm_build/surface/material_colours.h"
#include "pbm_build/surface/merge_surfaces.h"
#include "pbm_build/surface/vertex_normals.h"
#include "pbm_build/upsampling/upsample.h"
#include "pbm_build/voxels/sample_points.h"
#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/reading/reader.h"
#include "pbm_scan/conventions/convention.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/surface_reader.h"
#include "pbm_scan/text/printable.h"
#include "system/files/mapped_file.h"
#include "system/free_memory.h"
#include "system/threads/parallel.h"

namespace pbm::build {
namespace {

constexpr std::uint64_t kMaxMadeBytes = std::uint64_t{4} << 30; // of made points

// The options and the statistics of one build.
struct Run {
    const BuildOptions &options;
    BuildStatistics &statistics;
    StepClock &clock;
};

Error transparent() { return bad_input("the images are transparent everywhere: there is nothing to build"); }

Error with_input_name(const std::string &name, Error error) {
    if (!name.empty())
        error.message = name + ": " + error.message;
    return error;
}

// Refuses early, from a lower bound, a depth at which sample_points would exceed its limit.
Status check_hit_count(const Surface &surface, const Bounds &bounds, const Grid &grid, const BuildOptions &options) {
    const double edge = centred_grid(bounds, kMinDepth).edge() / grid.voxel_size;
    const double least =
        relative_area(surface, bounds, options.threads) * edge * edge; // a column of voxels per voxel^2 or more
    if (least <= static_cast<double>(options.max_samples))
        return {};
    return out_of_memory("depth " + std::to_string(grid.depth) + " would need at least " +
                         std::to_string(static_cast<std::uint64_t>(least)) + " samples, the limit is " +
                         std::to_string(options.max_samples) + "; choose a smaller --depth, or --max-points");
}

Status repair(Surface &surface, const BuildOptions &options, StepClock &clock, BuildStatistics &statistics) {
    if (surface.triangles.empty())
        return repair_mesh(surface, options.mesh, options.threads, statistics); // has only to say so
    return clock.run("mesh", [&] { return repair_mesh(surface, options.mesh, options.threads, statistics); });
}

AttributeSet choose_attributes(const Surface &surface, ColourFormat colour) {
    AttributeSet set;
    set.colour = surface.colours.empty() && surface.texture_ids.empty() ? ColourFormat::none : colour;
    set.material = surface.materials.size() > 1 && !surface.material_ids.empty();
    return set;
}

std::vector<Material> choose_materials(const Surface &surface, const AttributeSet &set) {
    std::vector<Material> materials = surface.materials;
    if (!set.material)
        materials.resize(1); // without an index per point all have the first, or the default one
    return materials;
}

// Fills gaps of the points as requested. Returns the voxels filled.
Result<std::vector<MortonCode>> fill_gaps(Surface &surface, VertexNormals &normals, std::span<const Field> fields,
                                          const Grid &grid, const Run &run) {
    const BuildOptions &options = run.options;
    if (!options.upsample || surface.point_count() == 0)
        return std::vector<MortonCode>{};
    Result<std::vector<MortonCode>> made = run.clock.run("upsample", [&] {
        return upsample(surface, normals, grid, {*options.upsample, kMaxMadeBytes, fields}, options.threads);
    });
    if (made)
        run.statistics.made_points = made->size();
    return made;
}

void report_made_points(const Surface &surface, const BuildOptions &options, BuildStatistics &statistics) {
    if (!options.upsample)
        return;
    if (surface.point_count() == 0)
        statistics.report(Warning::idle_option, "--upsample", "there are no points without faces");
    else
        statistics.report(Warning::made_points, "upsampling",
                          counted(statistics.made_points, "point") + " made in gaps of up to " +
                              counted(static_cast<std::uint64_t>(*options.upsample), "voxel"));
}

// Of a scan that was read.
struct Prepared {
    Surface surface;
    Bounds bounds;
    VertexNormals normals;
    AttributeSet set;
    std::vector<Field> fields;
    std::string metadata;
    Grid grid;
};

// Fills gaps, samples and voxelizes a part of the points at the depth of the grid. If the user set no depth, decrements
// it until the number of points is within max_points and that of samples within max_samples; a part of several knows
// only its own numbers, so it fails instead.
Result<Voxels> sample_and_voxelize(Prepared &scan, const PartNumber &part, const Run &run) {
    const BuildOptions &options = run.options;
    Surface &surface = scan.surface;
    Grid &grid = scan.grid;
    std::vector<TexturePyramid> images;
    if (!surface.textures.empty())
        images = run.clock.run("images", [&] { return make_pyramids(surface, options.threads); });
    const bool depth_is_free = !options.grid.depth && !options.grid.voxel_size && !options.grid.like;
    const int first_depth = grid.depth;
    const std::size_t given = surface.positions.size();
    for (;; grid.depth -= 1, grid.voxel_size *= 2) {
        const bool may_be_coarser = depth_is_free && grid.depth > kMinBuildDepth;
        if (Status checked = check_hit_count(surface, scan.bounds, grid, options); !checked) {
            if (may_be_coarser)
                continue;
            return checked.error();
        }
        remove_made_points(surface, scan.normals, given); // of a finer grid
        Result<std::vector<MortonCode>> filled = fill_gaps(surface, scan.normals, scan.fields, grid, run);
        if (!filled) {
            if (filled.error().code == ErrorCode::memory && may_be_coarser)
                continue;
            return filled.error();
        }
        const Bytes radii = given_radii(surface, grid);
        const std::vector<FieldSamples> field_values = field_samples(surface, scan.fields);
        const SurfaceSampler sampler(surface, images, scan.normals, radii, field_values, grid, options.threads);
        const BucketRange range = buckets_of_part(sampler, part, grid.depth);
        HitStore hits(grid.depth, resolve_threads(options.threads), options.max_samples);
        const Status sampled = run.clock.run(
            "sample points", [&](auto progress) { return sample_points(sampler, hits, range, progress); });
        if (!sampled && sampled.error().code == ErrorCode::memory && may_be_coarser && part.count == 1)
            continue;
        if (!sampled)
            return sampled.error();
        run.statistics.samples = hits.size();
        Voxels voxels = run.clock.run(
            "voxelize", [&] { return voxelize(sampler, hits, range, scan.set, scan.fields, options.threads); });
        voxels.made = std::move(*filled);
        if (part.count > 1) {
            const int local_bits = hits.local_bits();
            std::erase_if(voxels.made, [&](MortonCode code) { return !range.holds(code >> local_bits); });
            return voxels;
        }
        if (voxels.codes.empty())
            return transparent();
        if (!options.grid.max_points || voxels.codes.size() <= *options.grid.max_points) {
            if (!options.grid.max_points && grid.depth < first_depth)
                run.statistics.report(Warning::coarser_grid, "depth",
                                      std::to_string(grid.depth) + " instead of " + std::to_string(first_depth) +
                                          ", which needs too much memory for its samples");
            return voxels;
        }
        if (grid.depth == kMinBuildDepth)
            return usage("even the coarsest grid has " + std::to_string(voxels.codes.size()) +
                         " points; raise --max-points");
    }
}

// Computes the missing normals, then the radii.
void choose_radii(Voxels &voxels, bool has_points, int depth, int threads) {
    fill_normals(voxels, threads);
    if (has_points)
        return radii_from_neighbours(voxels, depth, threads);
    const RadiusClasses classes = radius_classes(depth);
    for (std::uint8_t &radius : voxels.points.radii)
        radius = classes[radius];
}

// Adds the scene: lights, textures, ground, shadows.
Status furnish(std::optional<Surface> triangles, Voxels &voxels, Model &model, const Run &run) {
    const BuildOptions &options = run.options;
    const SceneRequest &request = options.scene;
    const int threads = options.threads;
    ModelParameters &parameters = model.parameters;
    const Grid &grid = parameters.grid;
    AttributeSet &set = parameters.attributes;
    Result<Scene> scene = place_scene(request, grid, voxels.codes, parameters.materials, run.statistics);
    if (!scene)
        return scene.error();
    set.texture = !scene->texture.empty();
    choose_shadow_bits(request, *scene, grid.depth, set);
    if (set.texture || (scene->ground && scene->ground->texture))
        run.clock.run("solid texture", [&] { evaluate_solid_texture(request, *scene, voxels, model, threads); });
    if (set.lights > 0)
        run.clock.run("shadows", [&](auto shadow_progress) {
            bake_shadows(request, *scene, std::move(triangles), voxels, model, {threads, shadow_progress});
        });
    parameters.lights = std::move(scene->lights);
    parameters.texture = std::move(scene->texture);
    parameters.ground = scene->ground;
    return {};
}

// Replaces what the surfaces say of their scanners by one viewpoint for each.
void station_each(std::vector<Surface> &surfaces, const std::vector<std::array<double, 3>> &viewpoints) {
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

// Repairs, merges and cleans what was read.
Result<Surface> gather(std::vector<Surface> surfaces, const Run &run) {
    const BuildOptions &options = run.options;
    BuildStatistics &statistics = run.statistics;
    const int threads = options.threads;
    dress(surfaces, options.scene, statistics);
    if (options.viewpoints.size() > 1)
        station_each(surfaces, options.viewpoints);
    for (Surface &surface : surfaces) {
        count_input(surface, statistics);
        if (surface.positions.empty())
            continue;
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
    colour_beside_images(surface);
    statistics.attributes.insert(statistics.attributes.end(), surface.report.begin(), surface.report.end());
    if (outliers_of(options) != Outliers::keep)
        if (Status dropped = drop_far_parts(surface, options.strict, statistics); !dropped)
            return dropped.error();
    if (Status allowed = refuse_denied(statistics, options.denied); !allowed)
        return allowed.error();
    return merged;
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

// Chooses everything that depends on the scan as a whole.
Result<Prepared> prepare(std::vector<Surface> surfaces, const Run &run) {
    const BuildOptions &options = run.options;
    BuildStatistics &statistics = run.statistics;
    StepClock &clock = run.clock;
    const int threads = options.threads;
    std::vector<SinglePrecision> single_precision;
    const Convention convention = common_convention(surfaces);
    for (const Surface &surface : surfaces)
        if (surface.float_step > 0 && !surface.positions.empty())
            single_precision.push_back({surface.name, surface.float_step, surface.float_near});
    Result<Surface> gathered = gather(std::move(surfaces), run);
    if (!gathered)
        return gathered.error();
    Prepared scan;
    scan.surface = std::move(*gathered);
    Surface &surface = scan.surface;
    scan.bounds = bounds_of(surface);
    if (Status bounded = check_bounds(scan.bounds); !bounded)
        return bounded.error();
    scan.set = choose_attributes(surface, options.colour);
    Result<std::vector<Field>> fields = choose_fields(surface, options.fields, statistics);
    if (!fields)
        return fields.error();
    scan.fields = std::move(*fields);
    const bool has_crs = !surface.crs.empty();
    Result<std::string> metadata = make_metadata(options, scan.set.colour, surface.crs);
    if (!metadata)
        return metadata.error();
    scan.metadata = std::move(*metadata);
    if (has_crs)
        statistics.report("coordinate reference system", surface.crs.empty() ? Fate::dropped : Fate::kept,
                          surface.crs.empty() ? "the metadata has no room for it" : "in the metadata, as \"crs\"");

    GridRequest request = options.grid;
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

// Makes the points of a part. The surface stays in `scan`.
Result<Part> make_part(Prepared &scan, const PartNumber &number, const Run &run) {
    Result<Voxels> voxels = sample_and_voxelize(scan, number, run);
    if (!voxels)
        return voxels.error();
    report_made_points(scan.surface, run.options, run.statistics);
    if (Status allowed = refuse_denied(run.statistics, run.options.denied); !allowed)
        return allowed.error();
    scan.normals = {};
    Part part;
    part.parameters.grid = scan.grid;
    part.parameters.attributes = scan.set;
    part.parameters.fields = std::move(scan.fields);
    part.parameters.materials = choose_materials(scan.surface, scan.set);
    part.parameters.closed = scan.surface.closed;
    part.metadata = std::move(scan.metadata);
    part.has_points = scan.surface.point_count() > 0;
    part.voxels = std::move(*voxels);
    return part;
}

// Whether rays will be tested against the triangles of the surface.
bool needs_triangles(const BuildOptions &options, bool has_points) {
    const auto &shadows = options.scene.shadows;
    return shadows && !shadows->maps && !has_points;
}

// Computes what needs the neighbours of points, or all of them. `triangles`: of needs_triangles.
Result<Model> finish(Part whole, std::optional<Surface> triangles, const Run &run) {
    const int threads = run.options.threads;
    BuildStatistics &statistics = run.statistics;
    Voxels &voxels = whole.voxels;
    if (voxels.codes.size() > kMaxPoints)
        return too_large(std::to_string(voxels.codes.size()) + " points, a .pbvg file holds 2^32 - 1");
    const Grid grid = whole.parameters.grid;
    run.clock.run("choose radii", [&] { choose_radii(voxels, whole.has_points, grid.depth, threads); });

    Model model;
    model.parameters = std::move(whole.parameters);
    model.metadata = std::move(whole.metadata);
    if (Status furnished = furnish(std::move(triangles), voxels, model, run); !furnished)
        return furnished.error();
    if (Status allowed = refuse_denied(statistics, run.options.denied); !allowed)
        return allowed.error();
    run.clock.run("octree", [&] {
        LevelMasks masks = encode_octree(voxels.codes, grid.depth);
        free_memory(voxels.codes);
        model.levels.resize(masks.size());
        for (std::size_t level = 0; level < masks.size(); ++level)
            model.levels[level].masks = std::move(masks[level]);
        model.levels.back().points = std::move(voxels.points);
        model.levels.back().fields = std::move(voxels.fields);
    });
    run.clock.run("detail levels", [&] { average_levels(model, threads); });

    statistics.points = model.point_count();
    statistics.depth = grid.depth;
    statistics.voxel_size = grid.voxel_size;
    for (const std::uint16_t normal : model.levels.back().points.normals)
        statistics.two_sided_points += (normal & kTwoSidedBit) != 0 ? 1 : 0;
    return model;
}

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
                                            .strict = options.strict,
                                            .format = options.input_format,
                                            .columns = options.columns,
                                            .fields = field_names,
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

} // namespace

Result<Model> build_model(std::vector<Surface> surfaces, const BuildOptions &options, BuildStatistics &statistics,
                          const Progress &progress) {
    StepClock clock(statistics, progress);
    const Run run{options, statistics, clock};
    Result<Prepared> scan = prepare(std::move(surfaces), run);
    if (!scan)
        return scan.error();
    Result<Part> whole = make_part(*scan, {}, run);
    if (!whole)
        return whole.error();
    std::optional<Surface> triangles;
    if (needs_triangles(options, whole->has_points))
        triangles = std::move(scan->surface);
    scan->surface = {};
    return finish(std::move(*whole), std::move(triangles), run);
}

Result<Model> read_and_build(std::span<const std::string> inputs, const BuildOptions &options,
                             BuildStatistics &statistics, const Progress &progress) {
    StepClock clock(statistics, progress);
    Result<std::vector<Surface>> surfaces = read_surfaces(inputs, {options, statistics, clock});
    if (!surfaces)
        return surfaces.error();
    return build_model(std::move(*surfaces), options, statistics, progress);
}

Result<Part> read_and_build_part(std::span<const std::string> inputs, const PartNumber &number,
                                 const BuildOptions &options, BuildStatistics &statistics, const Progress &progress) {
    StepClock clock(statistics, progress);
    const Run run{options, statistics, clock};
    Result<std::vector<Surface>> surfaces = read_surfaces(inputs, run);
    if (!surfaces)
        return surfaces.error();
    Result<Prepared> scan = prepare(std::move(*surfaces), run);
    if (!scan)
        return scan.error();
    Result<Part> part = make_part(*scan, number, run);
    if (part)
        part->statistics = statistics;
    return part;
}

Result<Model> merge_parts(std::vector<Part> parts, std::span<const std::string> inputs, const BuildOptions &options,
                          BuildStatistics &statistics, const Progress &progress) {
    StepClock clock(statistics, progress);
    const Run run{options, statistics, clock};
    Part whole = clock.run("join", [&] { return join(std::move(parts)); });
    if (whole.voxels.codes.empty())
        return transparent();
    if (whole.statistics.samples > options.max_samples)
        return out_of_memory("the parts have " + std::to_string(whole.statistics.samples) +
                             " samples together, the limit is " + std::to_string(options.max_samples) +
                             "; choose a smaller --depth");
    std::optional<Surface> triangles;
    if (needs_triangles(options, whole.has_points)) {
        BuildStatistics ignored;
        Result<std::vector<Surface>> surfaces = read_surfaces(inputs, run);
        if (!surfaces)
            return surfaces.error();
        Result<Surface> gathered = gather(std::move(*surfaces), {options, ignored, clock});
        if (!gathered)
            return gathered.error();
        triangles = std::move(*gathered);
    }
    BuildStatistics &of_parts = whole.statistics;
    statistics.attributes.insert(statistics.attributes.end(), of_parts.attributes.begin(), of_parts.attributes.end());
    statistics.input_bytes = of_parts.input_bytes;
    statistics.vertices = of_parts.vertices;
    statistics.triangles = of_parts.triangles;
    statistics.samples = of_parts.samples;
    statistics.made_points = of_parts.made_points;
    return finish(std::move(whole), std::move(triangles), run);
}

namespace {

// Stored bytes of the panorama's section; 0 for standard output, which cannot be read back.
std::uint64_t stored_panorama_bytes(const std::string &output, const Model &model) {
    if (model.images.panorama.empty() || output == "-")
        return 0;
    const Result<MappedFile> file = MappedFile::open(output);
    if (!file)
        return 0;
    const Result<Reader> reader = Reader::open(file->bytes());
    const SectionEntry *const section = reader ? reader->section(SectionType::panorama) : nullptr;
    return section == nullptr ? 0 : section->stored_bytes;
}

} // namespace

Status write(const std::string &output, const Model &model, const BuildOptions &options, BuildStatistics &statistics,
             const Progress &progress) {
    StepClock clock(statistics, progress);
    const Result<std::uint64_t> written = clock.run("write", [&](auto write_progress) {
        return write_model(output, model,
                           {.storage = options.storage,
                            .compression_level = options.compression_level,
                            .threads = options.threads,
                            .progress = write_progress});
    });
    if (!written)
        return written.error();
    statistics.file_bytes = written.value();
    statistics.panorama_bytes = stored_panorama_bytes(output, model);
    return {};
}

} // namespace pbm::build
