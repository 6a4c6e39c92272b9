// A voxel grid model in memory: the writer's input, and the result of `load_model`.
// Stability: stable.
#pragma once

#include "pbm_format/model/octree.h"
#include "pbm_format/model/streams.h"
#include "system/bytes.h"

#include <array>
#include <cstddef>
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

// Position of the cube of 2^depth voxels per edge in model space (right-handed). BVG.md 3.4
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

// Phong coefficients (dissertation section 4.6). BVG.md 3.6.
// How the points of a material are drawn. BVG.md 18
enum class PointShape : std::uint8_t {
    disc = 0,  // a disc on the surface, across the normal
    round = 1, // a disc that faces the eye: the points lie on no surface
};

struct Material {
    float ka = 0.2F, kd = 0.7F, ks = 0.1F; // each 0..1
    float power = 16;                      // specular exponent, 1e-6..1024
    Rgb8 colour{204, 204, 204};            // sRGB, for points without a colour
    float environment = 0;                 // environment blending factor, 0..1
    PointShape shape = PointShape::disc;
    std::uint8_t tint = 0; // share of what it reflects of the panorama that has the point's colour, in 1/255. BVG.md 18
    bool operator==(const Material &) const = default;
};

inline bool is_round(const Material &material) { return material.shape == PointShape::round; }
// Whether its points reflect a panorama in their colour.
inline bool is_tinted(const Material &material) { return material.tint > 0 && material.environment > 0; }

enum class LightKind : std::uint8_t { directional = 0, point = 1, spot = 2 };

// BVG.md 3.7. Lights are fixed to the model; `direction` points along the light's travel.
struct Light {
    LightKind kind = LightKind::directional;
    std::array<float, 3> intensity{1, 1, 1};  // linear RGB, >= 0
    std::array<float, 3> position{};          // model units from the grid's minimum corner; point and spot lights
    std::array<float, 3> direction{0, 0, -1}; // unit length; directional and spot lights
    float exponent = 0;                       // spot lights: intensity times cos^exponent; 0..1024
    bool operator==(const Light &) const = default;
};

enum class TextureKind : std::uint8_t { marble = 1, wood = 2 };

// Parameters of the baked solid texture, and the palette that maps its values to colours. BVG.md 3.8
struct SolidTexture {
    TextureKind kind = TextureKind::marble;
    std::uint32_t seed = 0;
    float scale = 1;
    float turbulence = 0;
    std::array<Rgb8, 256> palette{};
    bool operator==(const SolidTexture &) const = default;
};

// A square under the object, perpendicular to the up axis. Its coordinates u and v run along the two axes after the up
// axis in the cycle x, y, z, so that u x v points up. BVG.md 3.11
struct GroundPlane {
    std::array<float, 3> centre{};       // model units from the grid's minimum corner
    float half_edge = 1;                 // model units, > 0
    std::uint8_t material = 0;           // index
    std::optional<SolidTexture> texture; // absent: the material's colour
    bool operator==(const GroundPlane &) const = default;
};

// A raster in memory. BVG.md 3.10
//
// Sides are powers of two, so that mip levels are exact. Panoramas are at most kMaxPanoramaWidth wide and half as high;
// rasters of the ground plane are squares of at most kMaxGroundRaster.
inline constexpr std::uint32_t kMaxPanoramaWidth = 16384;
inline constexpr std::uint32_t kMaxGroundRaster = 4096;

struct Image {
    std::uint32_t width = 0, height = 0;
    std::uint32_t channels = 1; // 1: values; 3: R, G, B, sRGB
    Bytes texels;               // [height][width][channels], top row first

    bool empty() const { return texels.empty(); }
    bool operator==(const Image &) const = default;
};

// Whether a file can hold a raster of this shape: 1 or 3 channels, powers of two, height <= width <= 2 x height, and
// width <= kMaxPanoramaWidth.
bool is_storable(std::uint32_t width, std::uint32_t height, std::uint32_t channels);

// Number of mip levels of a storable raster: from level 0, the raster itself, to the level of height 1.
int mip_levels(std::uint32_t height);

// The next mip level of a raster of height >= 2: each texel is the mean of 2x2. Three channels are averaged in linear
// light by the table of 6.3. One channel is averaged directly, even if it holds palette indices, because palettes are
// ramps. Normative: BVG.md 3.10.14
Image halved(const Image &finer);

// The rasters of a file. Texel (0, 0) of a raster of the ground plane has the lowest u and v; columns run along u.
struct ModelImages {
    // Equirectangular, width 2 x height, 3 channels; may be empty. The default camera looks at its middle; top is up.
    Image panorama;
    Image ground_texture;          // 1 channel, indices into the palette of GroundPlane::texture; may be empty
    std::vector<Image> ground_lit; // 1 channel, lit fraction x 255; one per light with a shadow stream, or none
    bool operator==(const ModelImages &) const = default;
};

// Fields: measured quantities of points, such as intensity or class, beside the attributes that every picture needs.
// BVG.md 17
//
//   value of a point = offset + scale x (stored - 1)        stored 1 .. 255 or 65,535; stored 0: the point has no value
inline constexpr std::size_t kMaxFields = 8;
inline constexpr std::size_t kMaxFieldName = 32, kMaxFieldUnit = 16; // bytes of UTF-8

// How a node gets its value from the points of the finest level below it that have one. BVG.md 17.3
enum class FieldAverage : std::uint8_t { mean = 0, majority = 1, maximum = 2 };
inline constexpr std::size_t kFieldAverages = 3;
inline std::string_view to_string(FieldAverage average) {
    constexpr std::array<std::string_view, kFieldAverages> kNames{"mean", "majority", "max"};
    return kNames[static_cast<std::size_t>(average)];
}

struct Field {
    std::string name;       // 1..kMaxFieldName bytes, printable; no two fields of a file have the same
    std::string unit;       // as people write it, "m"; may be empty
    double offset = 0;      // value of stored 1; finite
    double scale = 1;       // step of the values; finite, above 0
    std::uint8_t bytes = 1; // of a stored value: 1 or 2, little-endian
    FieldAverage average = FieldAverage::mean;
    bool operator==(const Field &) const = default;

    std::uint32_t max_stored() const { return bytes == 1 ? 255 : 65535; }
    double value(std::uint32_t stored) const { return offset + scale * (static_cast<double>(stored) - 1); }
};

// The stored value of point `i` in a column of a field.
inline std::uint32_t stored_value(ByteView column, std::size_t i, std::uint8_t bytes) {
    return bytes == 1 ? column[i] : static_cast<std::uint32_t>(column[2 * i] | column[2 * i + 1] << 8);
}
inline void set_stored_value(std::span<std::uint8_t> column, std::size_t i, std::uint8_t bytes, std::uint32_t stored) {
    column[bytes * i] = static_cast<std::uint8_t>(stored);
    if (bytes == 2)
        column[2 * i + 1] = static_cast<std::uint8_t>(stored >> 8);
}

// All data of a file that affect its pictures, except those per point or per texel.
struct ModelParameters {
    Grid grid;
    AttributeSet attributes;
    std::vector<Material> materials;   // 1..kMaxMaterials
    std::vector<Light> lights;         // 0..kMaxLights
    std::vector<SolidTexture> texture; // one if attributes.texture, else none
    std::optional<GroundPlane> ground;
    std::vector<Field> fields; // 0..kMaxFields
    bool closed = false;       // the surface is closed and its normals point outwards: BVG.md 2.19
    bool operator==(const ModelParameters &) const = default;
};

// The two sides of points that stand for a thin wall: each has the values of the wall's surface that faces its way.
// Such a point's own values are what its level holds without sides. BVG.md 19.4
struct Sides {
    std::vector<std::uint32_t> points; // their indices within the level, ascending
    // [points][2]. Radii are empty: both sides have that of the point. No normal has kTwoSidedBit.
    PointAttributes values;

    std::size_t size() const { return points.size(); }
    bool operator==(const Sides &) const = default;
};

// Where the surface lies within the voxels of some points: its distance from the centre of the voxel along the point's
// normal. Renderers estimate the offsets of the other points from the voxels around them. BVG.md 19.6
struct Offsets {
    static constexpr int kSteps = 16, kMost = 14; // of a value per voxel edge; the largest

    std::vector<std::uint32_t> points; // their indices within the level, ascending
    std::vector<std::int8_t> values;   // [points] -kMost..kMost

    std::size_t size() const { return points.size(); }
    bool operator==(const Offsets &) const = default;
};

// One detail level, which is a complete grid.
struct Level {
    Bytes masks;            // one per node of the level above
    PointAttributes points; // one record per node of this level
    // [fields][points x Field::bytes]: stored values. Empty if nobody asked for them.
    std::vector<Bytes> fields{};
    Sides sides{};     // of those points that have some; none of level 0
    Offsets offsets{}; // likewise
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

// Fills levels depth-1 .. 0 with the averages of the finest points (BVG.md 7): integer sums, one vote per
// finest point, independent of order, compiler and threads. Requires all `levels[L].masks` and `levels.back().points`.
void average_levels(Model &model, int threads);
// Replaces all levels of `model`: the octree whose finest nodes are `codes` (ascending, unique, not empty), their
// `points` and stored values of fields, and the averages above. Grid and attributes must be set.
void set_levels(Model &model, std::vector<MortonCode> codes, PointAttributes points, int threads,
                std::vector<Bytes> fields = {});
// The same for the fields (BVG.md 17.3), whose finest values are there; part of average_levels.
void average_fields(Model &model, int threads);
// Gathers the sides of levels depth-1 .. 1 from the finest points and their sides, and removes sides that look alike
// from all levels. The same for any number of threads. Requires the averages of all levels. BVG.md 19.5
void gather_sides(Model &model, int threads);

} // namespace pbm
