// fidelity_harness MESH FILE.pbvg [OPTIONS]: compares pictures of a model, drawn as by pbm-render or by the reference
// renderer, with its mesh. --help lists the options.
#include "close_ups.h"
#include "command_line/common_options.h"
#include "depth_by_angle.h"
#include "depth_misses.h"
#include "difference_pictures.h"
#include "error_places.h"
#include "fidelity.h"
#include "pbm_build/surface/corner_tangents.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_scan/surface_reader.h"
#include "shadow_truth.h"
#include "surface_oracle.h"
#include "system/files/mapped_file.h"
#include "viewer/options/option_values.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace pbm;

struct Options {
    std::string mesh, model;
    std::optional<double> max_error; // absent: the default of the quality
    int finest = kMaxDepth;
    int reference = 0; // level; 0: the fast renderer
    glm::ivec2 resolution{1280, 720};
    std::vector<std::string> qualities;
    int views = 8;
    bool first_view = false;
    bool close_ups = false;
    bool shading = false, shadows = true, shadow_flags = false, angles = false, places = false;
    bool true_offsets = false, true_normals = false;
    int samples = 8; // rays per pixel of the truth
    std::string pictures;
    std::string json; // file, "-" for standard output, empty for none
};

template <class T> T value_or_throw(Result<T> result, const std::string &file) {
    if (!result)
        throw std::runtime_error(file + ": " + result.error().message);
    return std::move(*result);
}

// The value between the four texels around a place of an image: linear light, or numbers 0..1.
glm::dvec3 texel_value(const build::Texture &image, const glm::dvec2 &place) {
    const auto index = [](double at, std::uint32_t size, build::Wrap wrap) {
        const double n = size;
        double within =
            wrap == build::Wrap::clamp ? std::clamp(at, 0.0, n - 1) : std::fmod(std::fmod(at, 2 * n) + 2 * n, 2 * n);
        if (wrap == build::Wrap::repeat && within >= n)
            within -= n;
        if (wrap == build::Wrap::mirror && within >= n)
            within = 2 * n - 1 - within;
        return static_cast<std::size_t>(within);
    };
    const glm::dvec2 at = place * glm::dvec2(image.width, image.height) - 0.5, low = glm::floor(at), part = at - low;
    glm::dvec3 colour(0);
    for (int i = 0; i < 4; ++i) {
        const double x = i & 1, y = i >> 1; // NOLINT(bugprone-integer-division)
        const auto &texel = image.texels[index(low.y + y, image.height, image.use.wrap[1]) * image.width +
                                         index(low.x + x, image.width, image.use.wrap[0])];
        const auto value = [&](std::size_t channel) {
            return image.use.content == build::ImageContent::colours ? to_linear(texel[channel])
                                                                     : texel[channel] / 255.0;
        };
        colour +=
            (x > 0 ? part.x : 1 - part.x) * (y > 0 ? part.y : 1 - part.y) * glm::dvec3(value(0), value(1), value(2));
    }
    return colour;
}

glm::dvec2 place_in(const build::TextureCorners &corners, const glm::dvec3 &weights) {
    return weights.x * glm::dvec2(corners[0]) + weights.y * glm::dvec2(corners[1]) + weights.z * glm::dvec2(corners[2]);
}

// The colour of the image of a triangle, times that of its vertices where the image is tinted.
std::optional<glm::dvec3> image_colour(const build::Surface &images, const TriangleMesh &mesh,
                                       const std::vector<glm::vec3> &colours, std::size_t triangle,
                                       const glm::dvec3 &weights) {
    const std::uint16_t id = images.texture_ids[triangle];
    if (id == build::Surface::kNoTexture)
        return std::nullopt;
    const build::TextureCorners &corners = images.texture_corners[triangle];
    const build::Texture &image = images.textures[id];
    glm::dvec3 colour = texel_value(image, place_in(corners, weights));
    if (image.use.is_tinted && !colours.empty()) {
        const glm::uvec3 &t = mesh.triangles[triangle];
        colour *= weights.x * glm::dvec3(colours[t.x]) + weights.y * glm::dvec3(colours[t.y]) +
                  weights.z * glm::dvec3(colours[t.z]);
    }
    return colour;
}

// The normal that the normal map of a triangle makes of `normal`.
glm::dvec3 mapped_normal(const build::Surface &images, std::span<const build::TriangleTangents> tangents,
                         std::size_t triangle, const glm::dvec3 &weights, const glm::dvec3 &normal) {
    const build::ImageLayer &layer = images.layer(build::Layer::normals);
    if (layer.ids[triangle] == build::Surface::kNoTexture)
        return normal;
    const build::Texture &image = images.textures[layer.ids[triangle]];
    const glm::dvec3 texel = 2.0 * texel_value(image, place_in(layer.corners[triangle], weights)) - 1.0;
    const build::TriangleTangents &of_corners = tangents[triangle];
    glm::dvec3 right(0);
    for (int c = 0; c < 3; ++c) {
        const build::ShortNormal &along = of_corners.along[static_cast<std::size_t>(c)];
        if (build::is_zero(along))
            return normal;
        right += weights[c] * glm::dvec3(along[0], along[1], along[2]) / build::kNormalScale;
    }
    const glm::dvec3 up = (of_corners.is_mirrored ? -1.0 : 1.0) * glm::cross(normal, right);
    const double scale = static_cast<double>(image.use.relief);
    return glm::normalize(scale * texel.x * right + scale * texel.y * up + texel.z * normal);
}

// The mesh for ray casting, wound so that its normals point to the visible side.
struct Subject {
    TriangleMesh mesh;
    SurfaceLook look;
};

Subject read_subject(const std::string &file) {
    build::Surface surface = value_or_throw(build::read_surface(file, build::ReadOptions{}), file);
    if (faces_point_inward({surface.positions, surface.triangles}, surface.normals))
        reverse_faces(surface);
    Subject subject{{surface.positions, surface.triangles}, {}};
    subject.look = look_of(subject.mesh, surface.normals);
    for (const Srgb &colour : surface.colours)
        subject.look.colours.emplace_back(to_linear(colour[0]), to_linear(colour[1]), to_linear(colour[2]));
    subject.look.materials = std::move(surface.material_ids);
    std::vector<build::ShortNormal> normals(subject.mesh.positions.size());
    for (std::size_t i = 0; i < surface.normals.size(); ++i)
        normals[i] = build::to_short_normal(glm::dvec3(surface.normals[i]));
    const auto images = std::make_shared<const build::Surface>(std::move(surface));
    if (!images->layer(build::Layer::normals).ids.empty())
        subject.look.relief = [images, tangents = build::corner_tangents(*images, normals, false, 0)](
                                  std::size_t triangle, const glm::dvec3 &weights, const glm::dvec3 &normal) {
            return mapped_normal(*images, tangents, triangle, weights, normal);
        };
    if (images->texture_ids.empty())
        return subject;
    subject.look.image = [images, mesh = subject.mesh, colours = subject.look.colours](std::size_t triangle,
                                                                                       const glm::dvec3 &weights) {
        return image_colour(*images, mesh, colours, triangle, weights);
    };
    return subject;
}

struct NamedView {
    std::string name;
    Camera camera;
    double pixels_per_voxel; // of the finest level, at the middle
};

std::vector<NamedView> choose_views(const RayCaster &rays, const Extent &extent, const ModelParameters &parameters,
                                    const Options &options) {
    const Grid &grid = parameters.grid;
    const auto whole = eight_views(extent.sphere, grid.up, options.resolution.x, options.resolution.y,
                                   shows_backs(Camera{}, parameters));
    std::vector<NamedView> views;
    const auto add = [&](const std::string &name, const Camera &camera) {
        const double distance = glm::length(camera.position - camera.focal_point);
        views.push_back(
            {name, camera, options.resolution.y / (2 * std::tan(camera.view_angle / 2)) / distance * grid.voxel_size});
    };
    if (options.first_view)
        add("first", default_camera(extent, grid.up, options.resolution.x, options.resolution.y));
    for (std::size_t i = 0; i < static_cast<std::size_t>(options.views); ++i)
        add("whole " + std::to_string(i), whole[i]);
    if (!options.close_ups)
        return views;
    const std::span<const Camera> around(whole.data(), static_cast<std::size_t>(std::clamp(options.views, 1, 4)));
    for (const CloseUp &near : close_ups(rays, around, grid.voxel_size, options.resolution.x, options.resolution.y))
        views.push_back({std::string(near.slanted ? "slanted " : "front ") + std::to_string(views.size()), near.camera,
                         near.pixels_per_voxel});
    return views;
}

// A renderer and its results.
struct Renderer {
    std::string name;
    Draw draw;
    std::vector<View> views{};
    DepthByAngle depths{};
    DepthMisses misses{};
    ErrorPlaces places{};
};

nlohmann::json to_json(const View &view) {
    const FidelityFigures &f = view.figures;
    return {{"object", f.object},
            {"interior", f.interior},
            {"holes", f.holes},
            {"see_through", f.see_through},
            {"bleed", f.bleed},
            {"shrunk", f.shrunk},
            {"deep", f.deep},
            {"deep_near", f.deep_near},
            {"on_surface", f.on_surface},
            {"squared_error", f.squared_error},
            {"seen", f.seen},
            {"seen_error", f.seen_error},
            {"level", view.drawn.level},
            {"points", view.drawn.points}};
}

nlohmann::json to_json(const std::vector<ShadowFigures> &lights) {
    nlohmann::json all = nlohmann::json::array();
    for (const ShadowFigures &light : lights)
        all.push_back({{"facing", light.facing},
                       {"lit", light.lit},
                       {"false_light", light.false_light},
                       {"false_shadow", light.false_shadow},
                       {"wrong", light.wrong()},
                       {"strictly_wrong", light.strictly_wrong()}});
    return all;
}

void print_shadows(const std::vector<ShadowFigures> &lights) {
    for (std::size_t i = 0; i < lights.size(); ++i)
        std::printf("light %zu: of %zu points that face it %.2f %% are lit; %.3f %% falsely lit, %.3f %% falsely dark; "
                    "%.3f %% wrong by strict rays\n",
                    i, lights[i].facing, percent(lights[i].lit, lights[i].facing),
                    percent(lights[i].false_light, lights[i].facing), percent(lights[i].false_shadow, lights[i].facing),
                    100 * lights[i].strictly_wrong());
}

nlohmann::json to_json(const std::vector<NamedView> &views, const std::vector<Renderer> &renderers) {
    nlohmann::json all = nlohmann::json::array();
    for (std::size_t i = 0; i < views.size(); ++i) {
        nlohmann::json figures;
        for (const Renderer &renderer : renderers)
            figures[renderer.name] = to_json(renderer.views[i]);
        all.push_back({{"name", views[i].name}, {"pixels_per_voxel", views[i].pixels_per_voxel}, {"figures", figures}});
    }
    return all;
}

void print_psnr(const std::vector<NamedView> &views, const Renderer &renderer) {
    std::printf("%s, PSNR of the interior and of all pixels of the object, dB\n", renderer.name.c_str());
    for (std::size_t i = 0; i < views.size(); ++i)
        std::printf("%-12s %6.2f %6.2f   (%.2f pixels per voxel of the finest level)\n", views[i].name.c_str(),
                    psnr(renderer.views[i].figures), psnr_seen(renderer.views[i].figures), views[i].pixels_per_voxel);
    std::printf("%-12s %6.2f %6.2f\n", "all", psnr(total(renderer.views)), psnr_seen(total(renderer.views)));
}

void measure(const RayCaster &rays, const Subject &subject, const ModelParameters &parameters,
             const std::vector<NamedView> &views, std::vector<Renderer> &renderers, const Options &options) {
    const auto &origin = parameters.grid.origin;
    TracedScene scene{.rays = rays,
                      .mesh = subject.mesh,
                      .look = subject.look,
                      .materials = {},
                      .lights = {},
                      .light_origin = {origin[0], origin[1], origin[2]},
                      .edge = parameters.grid.edge(),
                      .shows_backs = shows_backs(Camera{}, parameters),
                      .shadowed = options.shadows ? parameters.attributes.lights : 0};
    DrawnPicture drawing(options.resolution.x, options.resolution.y);
    const std::vector<SharpEdge> edges = options.places ? sharp_edges(subject.mesh) : std::vector<SharpEdge>();
    for (const NamedView &view : views) {
        const PictureTruth truth(rays.cast(view.camera, options.resolution.x, options.resolution.y, 0),
                                 options.resolution.x, scene.shows_backs);
        std::vector<Srgb> colours;
        const Appearance seen = appearance_in_frame(parameters, {}, eye_axes(view.camera), Appearance(parameters));
        scene.lights = seen.lights;
        scene.materials = seen.materials;
        if (options.shading)
            colours = trace(scene, view.camera, options.resolution.x, options.resolution.y, options.samples, 0);
        const std::string picture = options.pictures.empty() ? "" : options.pictures + "/" + view.name;
        if (!picture.empty() && options.shading)
            write_picture(picture + " truth.png", colours, options.resolution.x, options.resolution.y);
        for (Renderer &renderer : renderers) {
            renderer.draw(view.camera, drawing);
            renderer.views.push_back({.drawn = drawing.drawn, .figures = compare(truth, colours, drawing)});
            add_depth_errors(truth, drawing, renderer.depths);
            if (options.angles)
                add_depth_misses(rays, view.camera, truth, drawing, renderer.misses);
            if (options.places && options.shading)
                add_error_places(edges, view.camera, truth, colours, drawing.picture, renderer.places);
            if (picture.empty())
                continue;
            write_picture(picture + " " + renderer.name + ".png", drawing.picture);
            if (options.shading)
                write_difference(picture + " " + renderer.name + " difference.png", colours, drawing.picture);
        }
    }
}

Model load_whole(const MappedFile &file, const std::string &name) {
    Reader reader = value_or_throw(Reader::open(file.bytes()), name);
    return value_or_throw(load_model(reader), name);
}

// The file's bytes with the normals of the mesh.
Bytes with_true_normals(const MappedFile &file, const std::string &name, const RayCaster &rays) {
    Model model = load_whole(file, name);
    SurfaceOracle(rays, model.parameters.grid).replace_normals(model);
    return value_or_throw(encode_model(model, {.compression_level = 1}), name);
}

int run(const Options &options) {
    Subject subject = read_subject(options.mesh);
    const auto file = MappedFile::open(options.model);
    if (!file)
        throw std::runtime_error(options.model + ": " + file.error().message);
    const Extent extent = value_or_throw(
        StreamedModel(value_or_throw(Reader::open(file->bytes()), options.model)).bounds(), options.model);
    const RayCaster rays(subject.mesh, extent.sphere.centre);
    const Bytes changed = options.true_normals ? with_true_normals(*file, options.model, rays) : Bytes();
    StreamedModel model(value_or_throw(Reader::open(changed.empty() ? file->bytes() : changed), options.model));
    const ModelParameters &parameters = model.reader().parameters();
    if (parameters.materials.size() == 1) // --material
        subject.look.materials.clear();
    SurfaceOracle oracle(rays, parameters.grid);
    std::function<void(std::span<PointRun>)> change;
    if (options.true_offsets)
        change = [&oracle](std::span<PointRun> runs) { oracle.replace_offsets(runs); };

    RenderOptions look{
        .texture = false, .shadows = options.shadows, .panorama = false, .ground = false, .reflections = false};
    FastRenderer fast(parameters, model.reader().header().chunk_points, 0);
    FineRenderer fine(parameters, model.reader().header().chunk_points, 0, nullptr);
    std::optional<Model> whole;
    std::optional<ReferenceRenderer> reference;
    std::vector<Renderer> renderers;
    if (options.reference > 0) {
        whole = load_whole(*file, options.model);
        reference.emplace(*whole);
        renderers.push_back({"reference", draw_level(*reference, parameters.grid, options.reference)});
    } else {
        for (const std::string &quality : options.qualities) {
            const bool is_fine = quality == "fine";
            const double max_error =
                options.max_error.value_or(default_max_error(is_fine, options.resolution.x, options.resolution.y));
            renderers.push_back({quality, draw_detail(model, fast, max_error, options.finest, look,
                                                      is_fine ? &fine : nullptr, change)});
        }
    }

    const std::vector<NamedView> views = choose_views(rays, extent, parameters, options);
    measure(rays, subject, parameters, views, renderers, options);
    std::vector<ShadowFigures> shadows;
    if (options.shadow_flags)
        shadows = check_shadows(ShadowTruth(subject.mesh, extent.sphere.centre), load_whole(*file, options.model), 0);
    if (!options.json.empty()) {
        const nlohmann::json json{{"views", to_json(views, renderers)}, {"shadows", to_json(shadows)}};
        const Status told = command_line::write_text(options.json, json.dump(2) + "\n");
        return told ? 0 : command_line::fail("fidelity_harness", options.json, told.error());
    }
    print_shadows(shadows);
    for (const Renderer &renderer : renderers) {
        std::printf("%s: level %d, %llu points\n%s", renderer.name.c_str(), renderer.views[0].drawn.level,
                    static_cast<unsigned long long>(renderer.views[0].drawn.points), to_text(renderer.views).c_str());
        if (options.angles)
            std::fputs((to_text(renderer.depths) + to_text(renderer.misses)).c_str(), stdout);
        if (options.shading)
            print_psnr(views, renderer);
        if (options.places && options.shading)
            std::fputs(to_text(renderer.places).c_str(), stdout);
    }
    return 0;
}

int parse_and_run(int argc, char **argv) {
    using command_line::Integers;
    Options options;
    command_line::CommandLine line{"fidelity_harness",
                                   "How true the pictures of a model are to the mesh it was made from"};
    const auto add = [&](const char *names, auto &target, const char *help, const command_line::Check &check = {}) {
        line.add(names, help, &target, {.check = check});
    };
    line.add("MESH", "A scan with faces", &options.mesh, {.required = true});
    line.add("MODEL", "Made of it", &options.model, {.required = true});
    add("--max-error", options.max_error, "Largest voxels, pixels; default 2, of fine pictures 1.42",
        command_line::Numbers{0.1, 64});
    add("--finest", options.finest, "Draw no finer level", Integers{1, kMaxDepth});
    add("--reference", options.reference, "The reference renderer, this level");
    line.add("--resolution", "Of the pictures", command_line::stored(parse_resolution, options.resolution),
             {.type = "W,H"});
    line.add("--quality", "fast, fine or both with a comma between; default fast", &options.qualities,
             {.check = command_line::Words{"fast", "fine"}, .separator = ','});
    add("--views", options.views, "So many of the eight views of the whole model", Integers{0, 8});
    add("--first-view", options.first_view, "The first view of pbm-render, too");
    add("--close-ups", options.close_ups, "Close views, too: 4 to 8 pixels per voxel");
    add("--angles", options.angles, "Depths by the angle under which the surface is seen, and why they miss");
    add("--places", options.places, "With --shading: where the error lies");
    add("--true-offsets", options.true_offsets, "Surface offsets of the mesh instead of estimated ones");
    add("--true-normals", options.true_normals, "Normals of the mesh instead of the model's");
    add("--shading", options.shading, "Compare colours with the ray-traced picture");
    add("--samples", options.samples, "Rays per pixel of that picture", Integers{1, 256});
    add("!--no-shadows", options.shadows, "Neither has shadows");
    add("--shadow-flags", options.shadow_flags, "Compare baked shadows with rays");
    add("--pictures", options.pictures, "Folder for truth, picture and difference of every view");
    command_line::add_json(line, options.json, "Figures");
    if (const auto done = command_line::parse(line, argc, argv))
        return *done;
    if (options.qualities.empty())
        options.qualities = {"fast"};
    return run(options);
}

} // namespace

int main(int argc, char **argv) {
    try {
        return parse_and_run(argc, argv);
    } catch (const std::exception &error) {
        std::cerr << "fidelity_harness: " << error.what() << "\n";
        return 4;
    }
}
