// The scene around a scan: lights, materials, solid texture, shadows, ground plane, panorama. The user's request, and
// its conversion into parts of a model. Dissertation sections 4.5, 4.6, 5.6 and 5.7
#pragma once

#include "pbm_build/panorama/panorama.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_build/scene/light_request.h"
#include "pbm_build/texture/solid_texture.h"
#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <optional>
#include <string>
#include <vector>

namespace pbm::build {

inline constexpr std::uint32_t kDefaultGroundTexels = 1024;

struct GroundRequest {
    std::optional<TextureKind> texture;          // absent: plain
    std::string colours;                         // of the texture, as in TextureOptions
    std::optional<float> scale;                  // of the texture
    double size = 3.5;                           // half an edge, radii of the model's bounding sphere; 0.1..100
    std::optional<double> height;                // along the up axis, model coordinates; default: the lowest point
    std::optional<Material> material;            // default: a light grey
    std::uint32_t texels = kDefaultGroundTexels; // per edge of its shadows and texture: a power of two, 64..4,096
};

struct ShadowRequest {
    std::optional<int> bits; // of the lit fraction of finest points: 1, 2, 4, 8; default 1, 4 of lights with a size
    // 1..kMaxShadowMaps. Default: rays for a surface of triangles, else 4 maps; 24 rays or maps for a light with a
    // size, and up to 96 for its shadow on the ground.
    std::optional<int> maps;
};

struct PanoramaRequest {
    std::string file; // empty: the project's own
    PanoramaOptions options;
};

// An option as the user gave it; values of a repeated option are consecutive.
struct GivenOption {
    std::string name, value; // a flag: "true"
};

struct SceneRequest {
    std::vector<LightRequest> lights; // at most kMaxLights
    // Replace those of each input: one material replaces all, several replace its 1st, 2nd, ...
    std::vector<Material> materials;
    std::optional<Material> default_material; // of inputs that have none
    bool ignore_point_colours = false;
    std::optional<float> environment; // blending factor of all materials
    bool reflects = false;            // half of it where no material has one
    std::optional<TextureOptions> texture;
    std::optional<ShadowRequest> shadows;
    std::optional<GroundRequest> ground;
    std::optional<PanoramaRequest> panorama;

    std::vector<GivenOption> given{}; // for metadata
};

// Applies the request's materials and reflections to each input, before the inputs are merged, and drops point colours
// where the request ignores them. The report names what was replaced.
void set_materials(std::vector<Surface> &surfaces, const SceneRequest &request, BuildStatistics &statistics);

// Makes materials of the images of reflectance of all inputs (reflectance_materials.h), with room for that of the
// ground plane, and the request's reflections.
void set_image_materials(Surface &surface, const SceneRequest &request, int threads, BuildStatistics &statistics);

// The scene as the file stores it, and the parameters of its shadows.
struct Scene {
    ModelFrame frame;
    std::vector<Light> lights; // those that cast shadows first
    int shadowed_lights = 0;
    std::vector<double> light_sizes; // [lights], as ShadowOptions::light_size
    std::vector<SolidTexture> texture;
    std::optional<GroundPlane> ground;
};

// Places lights and ground plane around the voxels. Appends the ground's material to `materials`, those of the points,
// unless an equal one is there. A request for shadows or a ground plane without lights gets the two default lights of
// the viewers.
//
// errors  usage                texture options, see make_texture
//         unsupported_feature  more than kMaxMaterials materials with that of the ground
Result<Scene> place_scene(const SceneRequest &request, const Grid &grid, std::span<const MortonCode> codes,
                          std::vector<Material> &materials, BuildStatistics &statistics);

// Chooses the streams of lit fractions: the lights of `set` and their bits. Coarser levels store means, so they get
// more bits.
void choose_shadow_bits(const SceneRequest &request, const Scene &scene, int depth, AttributeSet &set);

struct BakeOptions {
    int threads = 0;
    std::function<void(double)> progress{}; // called with 0..1; may be empty
};

// Computes the lit fractions of the finest points and of the ground plane, for all lights with a stream. `model` has
// its grid and attributes. Rays are tested against `triangles`, which are freed as soon as their tree is built; without
// them only voxels cast shadows.
void bake_shadows(const SceneRequest &request, const Scene &scene, std::optional<Surface> triangles, Voxels &voxels,
                  Model &model, const BakeOptions &options);

// Computes the texture values of the finest points and of the ground plane. `model` has its grid.
void evaluate_solid_texture(const SceneRequest &request, const Scene &scene, Voxels &voxels, Model &model, int threads);

// errors  as read_panorama
Result<Image> make_panorama(const PanoramaRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
