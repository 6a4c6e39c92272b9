// A whole voxel grid model in memory: what the builder hands to the writer and what `load_model` returns.
#pragma once

#include "pbm_format/model/image.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/model/streams.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

enum class Unit : std::uint8_t {
    unknown = 0,
    metre = 1,
    millimetre = 2,
    centimetre = 3,
    inch = 4,
    foot = 5,
    kilometre = 6
};
enum class UpAxis : std::uint8_t { y = 0, z = 1, x = 2 };

inline std::string_view to_string(Unit unit) {
    constexpr std::array<std::string_view, 7> kNames{"unknown", "m", "mm", "cm", "in", "ft", "km"};
    return kNames[static_cast<std::size_t>(unit)];
}
inline std::string_view to_string(UpAxis up) {
    constexpr std::array<std::string_view, 3> kNames{"+y", "+z", "+x"};
    return kNames[static_cast<std::size_t>(up)];
}

// Where the cube of 2^depth voxels per edge lies in model space (right-handed). BVG.md section 3.4.
struct Grid {
    int depth = kMinDepth;          // kMinDepth..kMaxDepth
    std::array<double, 3> origin{}; // minimum corner, model units
    double voxel_size = 1;          // edge of a finest voxel, model units, > 0
    Unit unit = Unit::unknown;
    UpAxis up = UpAxis::y;

    double edge() const { return voxel_size * static_cast<double>(std::uint64_t{1} << depth); }
    double voxel_size_at(int level) const {
        return voxel_size * static_cast<double>(std::uint64_t{1} << (depth - level));
    }
    bool operator==(const Grid &) const = default;
};

// Phong coefficients (dissertation section 4.6). BVG.md section 3.6.
struct Material {
    float ka = 0.2F, kd = 0.7F, ks = 0.1F; // each 0..1
    float power = 16;                      // specular exponent, 0 < power <= 1024
    Rgb8 colour{204, 204, 204};            // sRGB, where points carry no colour
    float environment = 0;                 // environment blending factor, 0..1
    bool operator==(const Material &) const = default;
};

enum class LightKind : std::uint8_t { directional = 0, point = 1, spot = 2 };

// BVG.md section 3.7. Lights are fixed to the model; `direction` points along the light's travel.
struct Light {
    LightKind kind = LightKind::directional;
    std::array<float, 3> intensity{1, 1, 1};  // linear RGB, >= 0
    std::array<float, 3> position{};          // model units from the grid's minimum corner; point and spot lights
    std::array<float, 3> direction{0, 0, -1}; // unit length; directional and spot lights
    float exponent = 0;                       // spot lights: intensity x cos^exponent
    bool operator==(const Light &) const = default;
};

enum class TextureKind : std::uint8_t { marble = 1, wood = 2 };

// Parameters of the baked solid texture and the palette that turns its values into colours. BVG.md section 3.8.
struct SolidTexture {
    TextureKind kind = TextureKind::marble;
    std::uint32_t seed = 0;
    float scale = 1;
    float turbulence = 0;
    std::array<Rgb8, 256> palette{};
    bool operator==(const SolidTexture &) const = default;
};

// A square under the object, perpendicular to the up axis. Its own coordinates u and v run along the axes that follow
// the up axis in the cycle x, y, z, so that u x v is up. BVG.md section 3.11.
struct GroundPlane {
    std::array<float, 3> centre{};       // model units from the grid's minimum corner
    float half_edge = 1;                 // model units, > 0
    std::uint8_t material = 0;           // index
    std::optional<SolidTexture> texture; // absent: the material's colour
    bool operator==(const GroundPlane &) const = default;
};

// The rasters of a file. Texel (0, 0) of those of the ground plane lies at its least u and v, columns along u.
struct ModelImages {
    // Equirectangular, width 2 x height, 3 channels; empty without. The default camera looks at its middle, up is up.
    Image panorama;
    Image ground_texture;          // 1 channel, indices into the palette of GroundPlane::texture; empty without
    std::vector<Image> ground_lit; // 1 channel, lit fraction x 255; one for each light with a shadow stream, or none
    bool operator==(const ModelImages &) const = default;
};

// Everything of a file that is neither per point nor per texel and changes its pictures.
struct ModelParameters {
    Grid grid;
    AttributeSet attributes;
    std::vector<Material> materials;   // 1..kMaxMaterials
    std::vector<Light> lights;         // 0..kMaxLights
    std::vector<SolidTexture> texture; // one if attributes.texture, else none
    std::optional<GroundPlane> ground;
    bool operator==(const ModelParameters &) const = default;
};

// One detail level as a grid of its own.
struct Level {
    Bytes masks;            // one per node of the level above
    PointAttributes points; // one record per node of this level
    bool operator==(const Level &) const = default;
};

struct Model {
    ModelParameters parameters;
    std::string metadata; // JSON object, <= 4 KB
    // [depth + 1]; levels[0] is the root: no masks, one point. The last one holds the model's points.
    std::vector<Level> levels;
    ModelImages images;

    std::uint64_t point_count() const { return levels.empty() ? 0 : levels.back().points.size(); }
    bool operator==(const Model &) const = default;
};

// Fills levels depth-1 .. 0 with the averages of the finest points (BVG.md section 7): integer sums, one vote per
// finest point, so that nothing depends on order, compiler or thread count. `levels[L].masks` and
// `levels.back().points` must be there.
void average_levels(Model &model, int threads);

} // namespace pbm
