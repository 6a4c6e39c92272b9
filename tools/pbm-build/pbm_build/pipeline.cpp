#include "pbm_build/pipeline.h"

#include "pbm_build/neighbourhoods/neighbourhoods.h"
#include "pbm_build/offsets/stored_offsets.h"
#include "pbm_build/preparing/prepare.h"
#include "pbm_build/radii/border_radii.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_build/upsampling/upsample.h"
#include "pbm_build/voxels/sample_points.h"
#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/reading/reader.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "system/files/mapped_file.h"
#include "system/free_memory.h"
#include "system/threads/parallel.h"

namespace pbm::build {
namespace {

constexpr std::uint64_t kMaxMadeBytes = std::uint64_t{4} << 30; // of made points

Error transparent_images_error() {
    return bad_input("the images are transparent everywhere: there is nothing to build");
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

// Whether the depth of the grid follows from the surface, and may be decremented.
bool chooses_depth(const BuildOptions &options) {
    return !options.grid.depth && !options.grid.voxel_size && !options.grid.like;
}

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
    // A model of a chosen depth is for pictures of the whole screen, which show the error of an estimated offset, and
    // splats that reach over a border.
    const bool is_for_screens = chooses_depth(options) && surface.point_count() == 0;
    const int first_depth = grid.depth;
    const std::size_t given = surface.positions.size();
    for (;; grid.depth -= 1, grid.voxel_size *= 2) {
        const bool may_be_coarser = chooses_depth(options) && grid.depth > kMinBuildDepth;
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
        Voxels voxels = run.clock.run("voxelize", [&] {
            return voxelize(sampler, hits, range, scan.set, scan.fields, is_for_screens, options.threads);
        });
        voxels.made = std::move(*filled);
        const bool is_accepted =
            part.count > 1 || !options.grid.max_points || voxels.codes.size() <= *options.grid.max_points;
        if (is_for_screens && is_accepted)
            run.clock.run("borders", [&] {
                shrink_at_borders(surface, border_sides(surface, options.threads), grid, voxels, options.threads);
            });
        if (part.count > 1) {
            const int local_bits = hits.local_bits();
            std::erase_if(voxels.made, [&](MortonCode code) { return !range.holds(code >> local_bits); });
            return voxels;
        }
        if (voxels.codes.empty())
            return transparent_images_error();
        if (is_accepted) {
            if (!options.grid.max_points && grid.depth < first_depth)
                run.statistics.report(Warning::coarser_grid, "depth",
                                      std::to_string(grid.depth) + " instead of " + std::to_string(first_depth) +
                                          ", which needs too much memory for its samples");
            return voxels;
        }
        if (grid.depth == kMinBuildDepth)
            return usage_error("even the coarsest grid has " + std::to_string(voxels.codes.size()) +
                               " points; raise --max-points");
    }
}

// Computes the missing normals, then the radii.
void choose_radii(Part &whole, int threads) {
    Voxels &voxels = whole.voxels;
    const int depth = whole.parameters.grid.depth;
    fill_normals(voxels, threads);
    if (whole.has_points) {
        radii_from_neighbours(voxels, whole.parameters.materials, depth, threads);
        return settle_round(voxels, whole.parameters);
    }
    const RadiusClasses classes = radius_classes(depth);
    for (std::uint8_t &radius : voxels.points.radii)
        if (!ends_at_border(radius, depth))
            radius = classes[radius];
    restore_where_gaps_open(voxels, depth, threads);
}

// Adds the scene: lights, textures, ground, shadows.
Status add_scene(std::optional<Surface> triangles, Voxels &voxels, Model &model, const Run &run) {
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

// The sides of the finest points, which have the texture values of their points, and the lit fractions too unless they
// were baked. Frees those of the voxels.
Sides settle_sides(Voxels &voxels, const AttributeSet &set) {
    Sides sides{.points = {}, .values = std::move(voxels.sides.values)};
    auto code = voxels.codes.begin();
    for (const MortonCode with_sides : voxels.sides.codes) {
        code = std::lower_bound(code, voxels.codes.end(), with_sides);
        sides.points.push_back(static_cast<std::uint32_t>(code - voxels.codes.begin()));
    }
    free_memory(voxels.sides.codes);
    for (const StreamInfo &stream : streams_of(set)) {
        if (stream.kind != StreamKind::texture && stream.kind != StreamKind::shadow)
            continue;
        Bytes &values = sides.values.values(stream);
        for (std::size_t i = values.size() / 2; i < sides.size(); ++i)
            values.insert(values.end(), 2, voxels.points.values(stream)[sides.points[i]]);
    }
    return sides;
}

// Computes what needs the neighbours of points, or all of them. `triangles`: of needs_triangles.
Result<Model> finish(Part whole, std::optional<Surface> triangles, const Run &run) {
    const int threads = run.options.threads;
    BuildStatistics &statistics = run.statistics;
    Voxels &voxels = whole.voxels;
    if (voxels.codes.size() > kMaxPoints)
        return too_large(std::to_string(voxels.codes.size()) + " points, a .pbvg file holds 2^32 - 1");
    const Grid grid = whole.parameters.grid;
    run.clock.run("choose radii", [&] { choose_radii(whole, threads); });

    Model model;
    model.parameters = std::move(whole.parameters);
    model.metadata = std::move(whole.metadata);
    if (Status added = add_scene(std::move(triangles), voxels, model, run); !added)
        return added.error();
    if (Status allowed = refuse_denied(statistics, run.options.denied); !allowed)
        return allowed.error();
    std::optional<WrongEstimates> wrong;
    const std::vector<Material> &materials = model.parameters.materials;
    // The normals of round points mean nothing.
    const bool has_round = std::any_of(materials.begin(), materials.end(), is_round);
    if (!has_round && voxels.offsets.size() == voxels.codes.size())
        wrong = run.clock.run("surface offsets", [&] { return find_wrong_estimates(voxels, grid.depth, threads); });
    free_memory(voxels.offsets);
    run.clock.run("detail levels", [&] {
        Sides sides = settle_sides(voxels, model.parameters.attributes);
        set_levels(model, std::move(voxels.codes), std::move(voxels.points), threads, std::move(voxels.fields));
        model.levels.back().sides = std::move(sides);
        if (!has_round)
            gather_sides(model, threads);
        if (wrong)
            model.levels.back().offsets =
                choose_offsets(*wrong, model, std::max(kMinBudget, static_cast<double>(statistics.input_bytes)),
                               {.compression_level = run.options.compression_level, .threads = threads});
    });

    statistics.points = model.point_count();
    statistics.depth = grid.depth;
    statistics.voxel_size = grid.voxel_size;
    for (const std::uint16_t normal : model.levels.back().points.normals)
        statistics.two_sided_points += (normal & kTwoSidedBit) != 0 ? 1 : 0;
    return model;
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
        return transparent_images_error();
    if (whole.statistics.samples > options.max_samples)
        return out_of_memory("the parts have " + std::to_string(whole.statistics.samples) +
                             " samples together, the limit is " + std::to_string(options.max_samples) +
                             "; choose a smaller --depth");
    std::optional<Surface> triangles;
    if (needs_triangles(options, whole.has_points)) {
        BuildStatistics reported_by_parts;
        Result<std::vector<Surface>> surfaces = read_surfaces(inputs, run);
        if (!surfaces)
            return surfaces.error();
        Result<Surface> merged = merge_inputs(std::move(*surfaces), {options, reported_by_parts, clock});
        if (!merged)
            return merged.error();
        triangles = std::move(*merged);
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
