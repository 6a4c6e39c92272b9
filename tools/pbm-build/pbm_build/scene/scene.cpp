#include "pbm_build/scene/scene.h"

#include "pbm_bake/shadow_baker.h"
#include "pbm_build/images/reflectance_materials.h"
#include "pbm_build/panorama/default_panorama.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <span>

namespace pbm::build {
namespace {

constexpr Material kGroundMaterial{
    .ka = 0.22F, .kd = 0.72F, .ks = 0.06F, .power = 8, .colour = {196, 196, 192}, .environment = 0};
constexpr std::string_view kDefaultLights = "two";
constexpr int kHardMaps = 4, kSoftMaps = 24;
// Each map adds one step to a penumbra on the ground; steps wider than this show as bands.
constexpr double kPenumbraStep = 1.5; // texels
constexpr int kMaxGroundMaps = 96;
constexpr int kSoftBits = 4;

void drop_colours(Surface &surface, BuildStatistics &statistics) {
    constexpr const char *kWhy = "--ignore-point-colours";
    if (!surface.colours.empty() || !surface.texture_ids.empty() || !surface.face_colours.empty())
        statistics.report(Warning::replaced_attribute, "point colours", kWhy, surface.name);
    if (!surface.materials.empty())
        statistics.report(Warning::replaced_attribute, "materials", kWhy, surface.name);
    surface.colours.clear();
    for (Texture &texture : surface.textures)
        if (texture.use.content != ImageContent::normals)
            texture = {};
    surface.texture_ids.clear();
    surface.texture_corners.clear();
    surface.face_colours.clear();
    surface.materials.clear();
    surface.material_ids.clear();
    drop_reflectances(surface);
}

// One material replaces all; several replace the 1st, 2nd, ...
void replace_materials(Surface &surface, const std::vector<Material> &given, BuildStatistics &statistics) {
    const std::size_t own = std::max<std::size_t>(surface.materials.size(), 1);
    if (given.size() == 1) {
        if (own > 1)
            statistics.report("materials", Fate::converted, counted(own, "material") + " to one: --material",
                              surface.name);
        surface.materials = given;
        surface.material_ids.clear();
        return;
    }
    surface.materials.resize(own);
    std::copy_n(given.begin(), std::min(own, given.size()), surface.materials.begin());
    if (given.size() > own)
        statistics.report(Warning::idle_option, "materials",
                          "--material gives " + std::to_string(given.size()) + ", the input has " +
                              counted(own, "material"),
                          surface.name);
}

bool replaces_default(const SceneRequest &request) {
    return request.default_material || !request.materials.empty() || request.environment || request.reflects;
}

void drop_reflectance_images(Surface &surface, BuildStatistics &statistics) {
    if (surface.layer(Layer::reflectance).ids.empty())
        return;
    statistics.report(Warning::replaced_attribute, "images of roughness and metal", "--material", surface.name);
    drop_reflectances(surface);
}

void set_reflections(std::span<Surface> surfaces, const SceneRequest &request) {
    const auto asks = [](const Material &material) { return material.environment > 0; };
    const bool none_asks = std::none_of(surfaces.begin(), surfaces.end(), [&](const Surface &surface) {
        return std::any_of(surface.materials.begin(), surface.materials.end(), asks);
    });
    constexpr float kHalf = 0.5F; // as the dissertation measured it (its section 6.2)
    if (!request.environment && !(request.reflects && none_asks))
        return;
    for (Surface &surface : surfaces)
        for (Material &material : surface.materials)
            material.environment = request.environment.value_or(kHalf);
}

// Distance from the centre of the model; 1 for a directional light.
double distance_of(const Light &light, const ModelFrame &frame) {
    if (light.kind == LightKind::directional)
        return 1;
    return glm::length(glm::dvec3(light.position[0], light.position[1], light.position[2]) - frame.centre);
}

std::vector<LightRequest> lights_of(const SceneRequest &request, BuildStatistics &statistics) {
    if (!request.lights.empty() || (!request.shadows && !request.ground))
        return request.lights;
    statistics.report(Warning::default_lights, "lights", "none are given: the set 'two', which stays with the model");
    return light_set(kDefaultLights);
}

bool casts(const LightRequest &light, const SceneRequest &request) {
    return request.shadows.has_value() && light.shadows.value_or(true);
}

void place_lights(const SceneRequest &request, Scene &scene, BuildStatistics &statistics) {
    constexpr std::array<const char *, 3> kKinds{"directional", "point", "spot"};
    const std::vector<LightRequest> lights = lights_of(request, statistics);
    for (const bool with_shadows : {true, false}) // streams are those of the first lights
        for (std::size_t i = 0; i < lights.size(); ++i) {
            if (casts(lights[i], request) != with_shadows)
                continue;
            const Light light = place(lights[i], scene.frame);
            scene.lights.push_back(light);
            scene.light_sizes.push_back(lights[i].size * distance_of(light, scene.frame));
            scene.shadowed_lights += with_shadows ? 1 : 0;
        }
    for (std::size_t i = 0; i < lights.size(); ++i) {
        std::string note = kKinds[static_cast<std::size_t>(lights[i].kind)];
        if (casts(lights[i], request))
            note += lights[i].size > 0 ? ", soft shadows" : ", shadows";
        if (const std::string why = lights_nothing(place(lights[i], scene.frame), scene.frame); !why.empty())
            note += "; " + why;
        statistics.report("light " + std::to_string(i + 1), Fate::kept, note);
    }
}

GroundPlane ground_under(const ModelFrame &frame, const GroundRequest &request) {
    GroundPlane ground;
    glm::vec3 centre(frame.centre);
    centre[frame.up_axis] =
        static_cast<float>(request.height ? *request.height - frame.origin[frame.up_axis] : frame.lowest);
    ground.centre = {centre.x, centre.y, centre.z};
    ground.half_edge = static_cast<float>(request.size * frame.radius);
    return ground;
}

// Returns the index of the ground's material; appends the material if it is new.
Result<std::uint8_t> ground_material(const GroundRequest &request, std::vector<Material> &materials) {
    const Material wanted = request.material.value_or(kGroundMaterial);
    const auto found = std::find(materials.begin(), materials.end(), wanted);
    const auto index = static_cast<std::size_t>(found - materials.begin());
    if (index == kMaxMaterials)
        return unsupported("the ground plane's material would be one more than the " + std::to_string(kMaxMaterials) +
                           " of a .pbvg file; merge some of the scan's, or give --ground-material one of them");
    if (found == materials.end())
        materials.push_back(wanted);
    return static_cast<std::uint8_t>(index);
}

ShadowOptions shadow_options(const SceneRequest &request, const Scene &scene, std::size_t light, int threads) {
    const bool soft = scene.light_sizes[light] > 0;
    return {.maps = request.shadows->maps.value_or(soft ? kSoftMaps : kHardMaps),
            .light_size = scene.light_sizes[light],
            .threads = threads};
}

// One map per kPenumbraStep texels of the penumbra of the model's height.
int ground_maps(const SceneRequest &request, const Scene &scene, std::size_t light, int maps) {
    if (request.shadows->maps || !(scene.light_sizes[light] > 0))
        return std::max(maps, kHardGroundMaps);
    const double distance = distance_of(scene.lights[light], scene.frame);
    const double texel = 2 * static_cast<double>(scene.ground->half_edge) / request.ground->texels;
    const double penumbra = scene.light_sizes[light] / std::max(distance, 1e-30) * 2 * scene.frame.radius;
    return static_cast<int>(std::clamp<double>(std::ceil(penumbra / texel / kPenumbraStep), maps, kMaxGroundMaps));
}

TriangleTree tree_of(const Surface &surface, const Grid &grid, int threads) {
    const auto corner = [&](std::uint32_t position) {
        const glm::vec3 at((surface.positions[position] - vector_of(grid.origin)) / grid.voxel_size);
        return Position{at.x, at.y, at.z};
    };
    const auto triangle = [&](std::size_t i) {
        const glm::uvec3 &corners = surface.triangles[i];
        return TriangleTree::Triangle{corner(corners.x), corner(corners.y), corner(corners.z)};
    };
    return TriangleTree(surface.triangles.size(), triangle, threads);
}

// Bakes the shadows of one side after the other of thin walls, by rays: both sides of a wall lie in its voxels, and
// each is in the shadow of the other. Leaves their lit fractions out where the triangles are not the whole model.
class SideBaker {
  public:
    SideBaker(const Grid &grid, const Voxels &voxels, const TriangleTree &tree, int threads)
        : codes_(voxels.sides.codes) {
        if (codes_.empty())
            return;
        auto code = voxels.codes.begin();
        for (const MortonCode with_sides : codes_) {
            code = std::lower_bound(code, voxels.codes.end(), with_sides);
            radii_.push_back(voxels.points.radii[static_cast<std::size_t>(code - voxels.codes.begin())]);
        }
        for (std::size_t side = 0; side < 2; ++side) {
            for (std::size_t i = 0; i < codes_.size(); ++i)
                normals_[side].push_back(voxels.sides.values.normals[2 * i + side]);
            casters_[side].emplace(
                grid,
                PointsOfLevel{
                    .level = grid.depth, .codes = codes_, .normals = normals_[side], .radii = radii_, .closed = true},
                threads);
            rays_[side].emplace(*casters_[side], tree, threads, kLift);
        }
    }

    void bake(const Light &light, ShadowOptions options, Bytes &to) const {
        if (codes_.empty() || !rays_[0]->complete())
            return;
        options.progress = {};
        to.resize(2 * codes_.size());
        for (std::size_t side = 0; side < 2; ++side) {
            options.rays = &*rays_[side];
            const Bytes lit = bake_light(*casters_[side], light, options);
            for (std::size_t i = 0; i < lit.size(); ++i)
                to[2 * i + side] = lit[i];
        }
    }

  private:
    static constexpr float kLift = 1; // voxels: a ray starts in front of the whole wall

    std::span<const MortonCode> codes_;
    Bytes radii_;
    std::array<std::vector<std::uint16_t>, 2> normals_;
    std::array<std::optional<ShadowCasters>, 2> casters_;
    std::array<std::optional<ShadowRays>, 2> rays_;
};

} // namespace

void set_materials(std::vector<Surface> &surfaces, const SceneRequest &request, BuildStatistics &statistics) {
    for (Surface &surface : surfaces) {
        if (request.ignore_point_colours)
            drop_colours(surface, statistics);
        if (surface.materials.empty() && replaces_default(request))
            surface.materials = {request.default_material.value_or(Material{})};
        if (!request.materials.empty()) {
            drop_reflectance_images(surface, statistics);
            replace_materials(surface, request.materials, statistics);
        }
    }
    set_reflections(surfaces, request);
}

void set_image_materials(Surface &surface, const SceneRequest &request, int threads, BuildStatistics &statistics) {
    const std::size_t of_ground = request.ground ? 1 : 0;
    choose_reflectances(surface, request.default_material.value_or(Material{}), kMaxMaterials - of_ground, threads,
                        statistics);
    if (!surface.material_of_cell.empty())
        set_reflections({&surface, 1}, request);
}

Result<Scene> place_scene(const SceneRequest &request, const Grid &grid, std::span<const MortonCode> codes,
                          std::vector<Material> &materials, BuildStatistics &statistics) {
    Scene scene;
    scene.frame = frame_of(grid, codes);
    place_lights(request, scene, statistics);
    if (request.texture) {
        const Result<SolidTexture> texture = make_texture(*request.texture);
        if (!texture)
            return texture.error();
        scene.texture.push_back(*texture);
    }
    if (!request.ground)
        return scene;
    scene.ground = ground_under(scene.frame, *request.ground);
    const Result<std::uint8_t> material = ground_material(*request.ground, materials);
    if (!material)
        return material.error();
    scene.ground->material = *material;
    if (request.ground->texture) {
        const Result<SolidTexture> texture = make_texture(
            {.kind = *request.ground->texture, .colours = request.ground->colours, .scale = request.ground->scale});
        if (!texture)
            return texture.error();
        scene.ground->texture = *texture;
    }
    return scene;
}

void choose_shadow_bits(const SceneRequest &request, const Scene &scene, int depth, AttributeSet &set) {
    set.lights = scene.shadowed_lights;
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
        const int finest = request.shadows->bits.value_or(scene.light_sizes[light] > 0 ? kSoftBits : 1);
        for (int level = 0; level <= depth; ++level) {
            const int steps = depth - level;
            const int fractions = steps == 0 ? 1 : steps == 1 ? 2 : 4;
            set.shadow_bits[light][static_cast<std::size_t>(level)] =
                static_cast<std::uint8_t>(std::max(finest, fractions));
        }
    }
}

void bake_shadows(const SceneRequest &request, const Scene &scene, std::optional<Surface> triangles, Voxels &voxels,
                  Model &model, const BakeOptions &options) {
    const Grid &grid = model.parameters.grid;
    const AttributeSet &set = model.parameters.attributes;
    std::optional<TriangleTree> tree;
    if (triangles && scene.shadowed_lights > 0)
        tree.emplace(tree_of(*triangles, grid, options.threads));
    triangles.reset();
    const ShadowCasters casters(grid,
                                {.level = grid.depth,
                                 .codes = voxels.codes,
                                 .normals = voxels.points.normals,
                                 .radii = voxels.points.radii,
                                 .closed = model.parameters.closed},
                                options.threads);
    std::optional<ShadowRays> rays;
    std::optional<SideBaker> sides;
    if (tree) {
        rays.emplace(casters, *tree, options.threads);
        sides.emplace(grid, voxels, *tree, options.threads);
    }
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
        ShadowOptions shadow = shadow_options(request, scene, light, options.threads);
        shadow.rays = rays ? &*rays : nullptr;
        shadow.bits = set.shadow_bits[light][static_cast<std::size_t>(grid.depth)];
        const auto part = [&](double done) {
            if (options.progress)
                options.progress((static_cast<double>(light) + done) / set.lights);
        };
        shadow.progress = [&](double done) { part(scene.ground ? done / 2 : done); };
        voxels.points.shadows[light] = bake_light(casters, scene.lights[light], shadow);
        if (sides)
            sides->bake(scene.lights[light], shadow, voxels.sides.values.shadows[light]);
        if (!scene.ground)
            continue;
        shadow.maps = ground_maps(request, scene, light, shadow.maps);
        shadow.progress = [&](double done) { part((1 + done) / 2); };
        model.images.ground_lit.push_back(
            bake_ground(casters, scene.lights[light], *scene.ground, request.ground->texels, shadow));
    }
}

void evaluate_solid_texture(const SceneRequest &request, const Scene &scene, Voxels &voxels, Model &model,
                            int threads) {
    const Grid &grid = model.parameters.grid;
    if (!scene.texture.empty()) {
        voxels.points.textures.resize(voxels.codes.size());
        evaluate_texture(scene.texture.front(), grid, voxels.codes, voxels.points.textures, threads);
    }
    if (scene.ground && scene.ground->texture)
        model.images.ground_texture =
            evaluate_ground_texture(*scene.ground->texture, grid, *scene.ground, request.ground->texels, threads);
}

Result<Image> make_panorama(const PanoramaRequest &request, int threads, BuildStatistics &statistics) {
    const auto &[file, options] = request;
    if (file.empty()) {
        const std::uint32_t width = options.width != 0 ? options.width : kDefaultPanoramaWidth;
        statistics.report("panorama", Fate::kept, "the default one");
        return default_panorama(width, threads);
    }
    Result<Panorama> panorama = read_panorama(file, options);
    if (!panorama)
        return panorama.error();
    statistics.report("panorama", panorama->converted ? Fate::converted : Fate::kept, panorama->note);
    return std::move(panorama->image);
}

} // namespace pbm::build
