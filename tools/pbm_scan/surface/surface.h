// A scan as plain arrays: the result of every reader, and the input of the pipeline.
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_scan/surface/attribute_report.h"
#include "system/error.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <bitset>
#include <compare>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace pbm::build {

// How an image continues beyond its edges.
enum class Wrap : std::uint8_t { repeat, mirror, clamp };

inline constexpr float kUsualAlphaCutoff = 0.5; // of a material that cuts holes and names no other

// How a material reflects, as physically based renderers have it; 0..1 each (conventions/reflectance.h).
struct Reflectance {
    double roughness = 1;
    double metal = 0;
    double specular = 1; // factor of the reflection of what is no metal
    bool tints = true;   // a metal reflects in the colour of the surface; else that colour is not the metal's
    auto operator<=>(const Reflectance &) const = default;
};

// What the numbers of an image are.
enum class ImageContent : std::uint8_t {
    colours,
    normals,         // in the space of tangents: red along the tangent, green upwards in the image, 0..255 for -1..1
    relief,          // of files: such normals if it is coloured, heights if it is grey (normal_maps.h)
    reflectance,     // roughness, and its complement times metal and times specular (conventions/reflectance.h)
    emission,        // sRGB of light that the surface emits; in files without its factors
    darkness,        // red: share of ambient light that does not arrive
    roughness_metal, // of files: green is roughness, blue is metal
    specular_roughness_metal, // of several files: the same, and red is a factor of specular
    specular_gloss,           // of files: sRGB of the reflection, opacity is gloss
    occlusion,                // of files: red is the share of ambient light that arrives
};
inline bool are_colours(ImageContent content) {
    return content == ImageContent::colours || content == ImageContent::emission;
}

// How an image looks on triangles.
struct TextureUse {
    std::array<Wrap, 2> wrap{}; // to the right, downwards
    bool is_tinted = false;     // the colours of the vertices multiply it
    // Where texel x `opacity` x opacity of the vertices is less than `least_opacity`, the image cuts a hole. 0:
    // nowhere.
    float least_opacity = 0, opacity = 1;
    bool is_blended = false; // it does so only if it shows texels on both sides of that limit (image_holes.h)
    bool is_faded = false;   // the opacities of the vertices count
    ImageContent content = ImageContent::colours;
    float relief = 1;           // of normals: factor of their red and green; of heights: factor
    bool is_green_down = false; // of normals in files: green points downwards in the image
    Reflectance factors{};      // of reflectance in files; of specular_gloss: of reflection and gloss (`roughness`)
    std::array<float, 3> light{1, 1, 1}; // of emission in files: factors of its channels, linear, at least 0
    float strength = 1;                  // of occlusion in files: 0..1

    // `texel`: its opacity, 0..255.
    bool is_hole(std::uint8_t texel) const { return static_cast<float>(texel) * opacity < least_opacity * 255; }
    auto operator<=>(const TextureUse &) const = default;
};

// An image on triangles.
struct Texture {
    std::uint32_t width = 0, height = 0;
    std::vector<std::array<std::uint8_t, 4>> texels; // [height][width], top row first; sRGB or numbers, and opacity
    TextureUse use{};
    bool has_stray_bytes = false; // its file has bytes that belong to no part of the image
    std::uint8_t orientation = 1; // 1..8, as Exif says it; texture coordinates do not know it
};

// Texture coordinates at the corners of a triangle: x to the right, y downwards, 1 at the image's opposite edge.
using TextureCorners = std::array<glm::vec2, 3>;

// What images say of triangles besides their colours. Each layer has texture coordinates of its own.
// Triangles with emission or occlusion have an image of reflectance too.
enum class Layer : std::uint8_t { normals, reflectance, emission, occlusion };
inline constexpr std::size_t kLayers = 4;

// Its arrays are empty if no triangle has an image.
struct ImageLayer {
    std::vector<TextureCorners> corners; // [triangles]
    std::vector<std::uint16_t> ids;      // [triangles] < Surface::textures.size(), or Surface::kNoTexture
};

// The colour of a face, in place of those of its vertices.
struct FaceColour {
    Rgb8 colour{}; // sRGB
    bool is_given = false;
    bool operator==(const FaceColour &) const = default;
};

// The value of a field at a vertex; NaN: none.
struct FieldValue {
    double number = std::numeric_limits<double>::quiet_NaN();
};
inline constexpr std::size_t kFieldSlots = kMaxFields + 1; // the last one: the classes for ReadOptions::dropped_classes

inline constexpr std::size_t kMaxCrsBytes = 65536;

inline constexpr std::uint16_t kNoStation = 0xffff; // it is not known where the scanner stood

// What the format of a scan, or its coordinate reference system, says of the coordinates (conventions/convention.h).
struct Convention {
    std::optional<UpAxis> up{};
    bool is_firm = true;        // the shape of the scan does not overrule `up`
    std::string up_reason{};    // for the report
    Unit unit = Unit::unknown;  // of the coordinates
    std::string unit_reason{};  // for the report
    bool is_geographic = false; // x and y are degrees
    double height_metres = 1;   // of a unit of height, beside degrees
};

// A camera of the file.
struct SceneView {
    std::string name{};                                // UTF-8; may be empty
    glm::dvec3 position{}, focal_point{}, up{0, 1, 0}; // model space, all finite; `up` is a unit vector
    double view_angle = 0.5;                           // from bottom to top, radians
    bool is_orthographic = false;                      // then it spans what the angle spans at the focal point
};

// Arrays run in parallel with `positions`, or are empty where the input has no such attribute.
struct Surface {
    std::string name;                         // which of several inputs, for reports; empty where there is only one
    std::vector<glm::dvec3> positions;        // model units, all finite
    std::vector<glm::uvec3> triangles;        // indices < positions.size(), three different ones; wound as in the file
    std::vector<glm::vec3> normals;           // as given, any length; zero length means "none here"
    std::vector<Rgb8> colours;                // sRGB
    std::vector<std::uint8_t> transparencies; // 255 - opacity, which counts where images cut holes
    std::vector<float> radii;                 // splat radius, model units; 0: none here
    std::vector<std::uint8_t> two_sided;      // 1: the point shows both of its sides
    std::vector<std::uint8_t> material_ids;   // < materials.size()
    std::vector<Material> materials;          // empty: the default material
    // [materials] what they come from; none: from coefficients. Empty, or some triangles have an image of reflectance.
    std::vector<std::optional<Reflectance>> reflectances;
    // [cells] the material of each look of images (images/surface_looks.h), or empty.
    std::vector<std::uint8_t> material_of_cell;
    std::vector<std::uint16_t> station_ids; // < stations.size(), or kNoStation
    std::vector<glm::dvec3> stations;       // where the scanner stood, model units, all finite; at most kNoStation
    std::vector<Texture> textures;
    std::vector<TextureCorners> texture_corners; // [triangles]; empty without textures
    std::vector<std::uint16_t> texture_ids;      // [triangles] < textures.size(), or kNoTexture; empty without textures
    std::array<ImageLayer, kLayers> layers;      // by Layer
    std::vector<glm::vec4> tangents;             // for normal maps: direction, and 1 or -1 if the image is mirrored;
                                                 // zero: computed from texture coordinates (corner_tangents.h)
    std::vector<FaceColour> face_colours;        // [triangles]; an image wins; empty: no face has a colour of its own
    std::array<std::vector<FieldValue>, kFieldSlots> field_values;   // by their number in ReadOptions::fields,
                                                                     // then in usual_fields
    std::array<std::optional<std::string>, kFieldSlots> field_units; // absent: the file has no such field
    std::vector<std::string> offered_fields;                         // attributes that could be fields
    std::vector<AttributeReport> report;                             // in the order of the file
    std::vector<SceneView> views;                                    // cameras of the file
    std::vector<std::string> part_names; // of parts of the file, UTF-8; none twice in a file
    std::string crs;                     // coordinate reference system, as the file has it; at most kMaxCrsBytes
    Convention convention;
    std::uint64_t dropped_vertices = 0;  // not finite
    std::uint64_t dropped_triangles = 0; // fewer than three different corners, or at a dropped vertex
    std::uint64_t input_bytes = 0;       // of the file
    std::uint64_t vertex_copies = 0;     // made where corners of a vertex differ; includes dropped copies

    // Edges whose faces meet at this angle (radians) or more are creases; used where no normals are given. 0: each face
    // has its own normal. Absent: the angle follows from the shape (corner_normals.h).
    std::optional<double> crease_angle;
    bool has_facets = false; // the file (STL, glTF without normals) does not say which edges are smooth

    // [triangles] kFlat, or a number: edges are smooth between faces of one number, and between no others. 0: by
    // `crease_angle`. Empty: all are 0.
    std::vector<std::uint32_t> smoothing_groups;

    static constexpr std::uint16_t kNoTexture = std::numeric_limits<std::uint16_t>::max();
    static constexpr std::uint32_t kFlat = std::numeric_limits<std::uint32_t>::max(); // the face has its own normal

    // In a surface with triangles: the number of points without a triangle. They are the last positions
    // (merge_surfaces.h).
    std::size_t points_beside_triangles = 0;

    // All faces bound volumes, all faces and normals point out of them, and no other points exist. Set by wind_faces.
    bool closed = false;

    // Set by `place` (placement.h) if all coordinates of an axis are in single precision: the spacing of floats at the
    // largest coordinate (model units), and that coordinate as in the file. Otherwise 0.
    double float_step = 0, float_near = 0;

    // Points without triangles are last; without any triangles all positions are points.
    std::size_t point_count() const { return triangles.empty() ? positions.size() : points_beside_triangles; }
    std::size_t first_point() const { return positions.size() - point_count(); }

    ImageLayer &layer(Layer of) { return layers[static_cast<std::size_t>(of)]; }
    const ImageLayer &layer(Layer of) const { return layers[static_cast<std::size_t>(of)]; }
};

// A vertex attribute of one byte, equal in a PLY file and in memory.
struct ByteAttribute {
    std::string_view property; // of a PLY vertex, uchar
    std::string_view note;     // for the report
    std::vector<std::uint8_t> Surface::*values;
};
inline constexpr std::array kByteAttributes{
    ByteAttribute{"two_sided", "points that show both of their sides", &Surface::two_sided}};

// Calls `visit` for each array of vertex attributes of one byte, which are never mixed, with that array of each of
// `surfaces`.
inline constexpr std::size_t kByteArrays = 1 + kByteAttributes.size();
template <class Visit, class... Surfaces> void for_byte_attributes(Visit &&visit, Surfaces &...surfaces) {
    visit(surfaces.material_ids...);
    for (const ByteAttribute &attribute : kByteAttributes)
        visit(surfaces.*attribute.values...);
}

// The same for each array of vertex attributes.
template <class Visit, class... Surfaces> void for_vertex_attributes(Visit &&visit, Surfaces &...surfaces) {
    visit(surfaces.normals...);
    visit(surfaces.tangents...);
    visit(surfaces.colours...);
    visit(surfaces.transparencies...);
    visit(surfaces.radii...);
    visit(surfaces.station_ids...);
    for_byte_attributes(visit, surfaces...);
    for (std::size_t slot = 0; slot < kFieldSlots; ++slot)
        visit(surfaces.field_values[slot]...);
}

// Calls `visit` for each array of triangle attributes, as for_vertex_attributes does.
template <class Visit, class... Surfaces> void for_triangle_attributes(Visit &&visit, Surfaces &...surfaces) {
    visit(surfaces.texture_corners...);
    visit(surfaces.texture_ids...);
    for (std::size_t layer = 0; layer < kLayers; ++layer) {
        visit(surfaces.layers[layer].corners...);
        visit(surfaces.layers[layer].ids...);
    }
    visit(surfaces.face_colours...);
    visit(surfaces.smoothing_groups...);
}

// Gives one of these arrays `count` values; new triangles have no image, no colour and no smoothing group.
template <class Value> void resize_for_triangles(std::vector<Value> &values, std::size_t count) {
    if constexpr (std::is_same_v<Value, std::uint16_t>)
        values.resize(count, Surface::kNoTexture);
    else
        values.resize(count);
}

inline void reverse_face(Surface &surface, std::size_t triangle) {
    std::swap(surface.triangles[triangle].y, surface.triangles[triangle].z);
    const auto reverse = [triangle](std::vector<TextureCorners> &corners) {
        if (!corners.empty())
            std::swap(corners[triangle][1], corners[triangle][2]);
    };
    reverse(surface.texture_corners);
    for (ImageLayer &layer : surface.layers)
        reverse(layer.corners);
}
inline void reverse_faces(Surface &surface) {
    for (std::size_t i = 0; i < surface.triangles.size(); ++i)
        reverse_face(surface, i);
}

// colour x `factor`, rounded and clamped to 0..255; NaN becomes 0.
Rgb8 colour_bytes(const glm::vec3 &colour, float factor);

// infinity - infinity and NaN - NaN are NaN.
inline bool is_finite(const glm::dvec3 &p) { return (p.x - p.x) + (p.y - p.y) + (p.z - p.z) == 0.0; }

// Removes the values from `first` on for which keep(index) is false.
template <class T, class Keep> void keep_from(std::vector<T> &values, std::size_t first, const Keep &keep) {
    std::size_t kept = first;
    for (std::size_t i = first; i < values.size(); ++i)
        if (keep(i))
            values[kept++] = values[i];
    values.resize(std::min(kept, values.size()));
}

struct ScanFormat; // scan_format.h

// A file that a scan names.
struct NamedFile {
    std::string name;  // as the scan has it
    std::string file;  // the existing one; empty: there is none
    std::string place; // where it is looked for first: a file that appears there is read instead of `file`
};

// Maximum number of vertices of a mesh.
inline constexpr std::uint64_t kMaxVertices = std::numeric_limits<std::int32_t>::max();

// Options of every reader.
struct ReadOptions {
    bool is_one_of_several = false;              // other inputs exist: it is no error if this one keeps no point
    bool is_geographic = false;                  // x and y are degrees, whatever the file says
    bool keep_placeholders = false;              // keep points that stand for no measurement (placeholders.h)
    bool flip_green = false;                     // the green of normal maps points downwards
    double min_opacity = 0.2;                    // 0..1: fainter Gaussian splats are left out
    bool strict = false;                         // refuse (`bad_input`) instead of dropping anything
    const ScanFormat *format = nullptr;          // of files that neither content nor name identifies (surface_reader.h)
    std::vector<std::string> columns{};          // names of a table's columns (text_cloud.h); empty: from the table
    std::vector<std::string> fields{};           // names of attributes to keep, at most kMaxFields
    std::vector<std::string> usual_fields{};     // of laser scans, kept behind those if there is room in kMaxFields
    std::bitset<256> dropped_classes{};          // points with these classes are left out
    Material default_material{};                 // values that a material of the file does not set
    std::function<void(double done)> progress{}; // called from the calling thread with 0..1; may be empty
    int threads = 0;                             // of readers that use several; 0: one per processor
};

// Removes the triangles for which is_gone(triangle) is true, with their attributes. Returns their number.
template <class Gone> std::size_t erase_triangles(Surface &surface, const Gone &is_gone) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        if (is_gone(surface.triangles[i]))
            continue;
        surface.triangles[kept] = surface.triangles[i];
        for_triangle_attributes(
            [&](auto &values) {
                if (!values.empty())
                    values[kept] = values[i];
            },
            surface);
        ++kept;
    }
    const std::size_t erased = surface.triangles.size() - kept;
    surface.triangles.resize(kept);
    for_triangle_attributes([&](auto &values) { values.resize(std::min(kept, values.size())); }, surface);
    return erased;
}

// Removes the vertices for which removed[index] is not 0, with their attributes and triangles, and numbers the others
// anew. Returns how many triangles were removed.
std::size_t erase_vertices(Surface &surface, std::span<const std::uint8_t> removed);

// The last step of every reader: removes and counts vertices with non-finite coordinates, with their attributes and
// triangles, then placeholders (placeholders.h), then points of dropped classes. With ReadOptions::strict refuses a
// surface if anything of the file was dropped.
//
// errors  bad_input  no vertex is left, unless it is one of several inputs; with `strict` something was dropped
Result<Surface> finished(Surface surface, const ReadOptions &options);

} // namespace pbm::build
