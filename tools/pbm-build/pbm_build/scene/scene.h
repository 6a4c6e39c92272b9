// The scene around a scan: lights, materials, solid texture, shadows, ground plane, panorama. What a user asks for, and
// how it becomes part of a model. Dissertation sections 4.5, 4.6, 5.6 and 5.7
#pragma once

#include "pbm_build/panorama/panorama.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_build/scene/light_request.h"
#include "pbm_build/scene/metadata.h"
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
    std::optional<SurfaceMaterial> material;     // default: a light grey
    std::uint32_t texels = kDefaultGroundTexels; // per edge of its shadows and texture: a power of two, 64..4,096
};

struct ShadowRequest {
    std::optional<int> bits; // of the lit fraction of finest points: 1, 2, 4, 8; default 1, 4 of lights with a size
    // 1..kMaxShadowMaps. Default: rays where there are triangles, else 4; 24 of lights with a size (rays or maps), for
    // whose shadow on the ground it is up to 96.
    std::optional<int> maps;
};

struct PanoramaRequest {
    std::string file; // empty: the project's own
    PanoramaOptions options;
};

struct SceneRequest {
    std::vector<LightRequest> lights; // at most kMaxLights
    // Instead of those of each input: one for all of it, or one for each of its materials, in their order.
    std::vector<SurfaceMaterial> materials;
    std::optional<SurfaceMaterial> default_material; // of inputs that have none
    bool ignore_point_colours = false;
    std::optional<float> environment; // blending factor of all materials
    bool reflects = false;            // half of it where no material has one
    std::optional<TextureOptions> texture;
    std::optional<ShadowRequest> shadows;
    std::optional<GroundRequest> ground;
    std::optional<PanoramaRequest> panorama;

    std::vector<GivenOption> given{}; // for metadata
};

// Colours and materials of each input, before they are merged. Lines of the report say what was replaced.
void dress(std::vector<Surface> &surfaces, const SceneRequest &request, BuildStatistics &statistics);

// What a file holds of the scene, and how its shadows are baked.
struct Scene {
    ModelFrame frame;
    std::vector<Light> lights; // those that cast shadows first
    int shadowed_lights = 0;
    std::vector<double> light_sizes; // [lights], as ShadowOptions::light_size
    std::vector<SolidTexture> texture;
    std::optional<GroundPlane> ground;
};

// Places lights and ground plane around the voxels; the ground's material joins `materials`, which are those of points.
// Without lights, where shadows or a ground plane are asked for, there are the two that viewers take by themselves.
//
// errors  usage                texture options, see make_texture
//         unsupported_feature  more than kMaxMaterials materials with that of the ground
Result<Scene> place_scene(const SceneRequest &request, const Grid &grid, std::span<const MortonCode> codes,
                          std::vector<Material> &materials, BuildStatistics &statistics);

// Streams for lit fractions: fills the lights of `set`. Coarser levels have more bits: they hold fractions.
void choose_shadow_bits(const SceneRequest &request, const Scene &scene, int depth, AttributeSet &set);

// Lit fractions of the finest points and of the ground plane of `model`, whose grid and attributes are known, for all
// lights with a stream. What is `surface` is let go as
// soon as it may be: the triangles of one that has no points of its own stop rays to the lights, unless shadow maps are
// asked for; else voxels are all that casts shadows.
void bake_shadows(const SceneRequest &request, const Scene &scene, Surface surface, Voxels &voxels, Model &model,
                  int threads, const std::function<void(double)> &progress);

// Texture values of the finest points and of the ground plane of `model`, whose grid is known.
void evaluate_solid_texture(const SceneRequest &request, const Scene &scene, Voxels &voxels, Model &model, int threads);

// errors  as read_panorama
Result<Image> make_panorama(const PanoramaRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
