// Material files (MTL) of OBJ files.
// Based on: Wavefront. Advanced Visualizer manual, MTL material format. 1995
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// Larger material files are not read.
inline constexpr std::size_t kMaxMaterialBytes = std::size_t{1} << 20;

// An image of a material (`map_Kd`, `map_d`, `norm`, `bump`, `map_Pr`, `map_Pm`, `map_Ke`), and how it lies on the
// surface: place in the image = `scale` x texture coordinates + `offset`.
struct MaterialImage {
    std::string file; // as named; empty: no image
    glm::vec2 scale{1}, offset{0};
    bool is_clamped = false;
    float bump = 1; // -bm: factor of heights, or of the slopes of normals

    bool lies_as(const MaterialImage &other) const {
        return scale == other.scale && offset == other.offset && is_clamped == other.is_clamped;
    }
};

struct NamedMaterial {
    std::string name;
    Material material; // without `colour`
    MaterialImage image{};
    MaterialImage opacity_image{};
    MaterialImage normal_image{}, bump_image{}; // the second one holds heights if it is grey, else normals
    MaterialImage roughness_image{}, metal_image{}, emission_image{};
    bool is_opacity_inverted = false;           // white is transparent: `map_Tr`
    float opacity = 1;                          // `d`, 1 - `Tr`
    std::optional<glm::dvec3> colour{};         // `Kd` as in the file
    std::optional<double> roughness{}, metal{}; // `Pr`, `Pm`: 0..1
    Rgb8 emission{};                            // `Ke`, sRGB
    // Of the materials with `Pr`, `Pm` or light of their own; set by finish_reflectance.
    std::optional<Reflectance> reflectance{};

    bool emits() const { return emission != Rgb8{} || !emission_image.file.empty(); }
};

// Appends the materials of a file to `materials`, and a line to `report` for each statement that is not kept as it is.
//   Kd  the colour, as sRGB: what viewers show
//   Ks  ks, the mean of its channels
//   Ns  power, 1..1024
//   Pr, Pm  roughness and metal, in place of Ks and Ns
//   Ke  light that is added to the colour, as sRGB
//   map_Kd  the image, with -o, -s and -clamp
//   map_d, map_Tr  the image of the opacity, likewise
//   norm  the image of normals, likewise, and with -bm
//   bump, map_Bump  the image of heights or normals, likewise
//   map_Pr, map_Pm, map_Ke  the images of roughness, metal and light, likewise; in place of Pr, Pm and Ke
// Values that the file does not set are those of `default_material`. Statements that make no sense are dropped.
void read_materials(std::string_view text, const Material &default_material, std::vector<NamedMaterial> &materials,
                    std::vector<AttributeReport> &report);

// Converts the colours of all files of a scan, whose range is that of nearly all (colour_range.h), to those of the
// materials.
void finish_colours(std::span<NamedMaterial> materials, std::vector<AttributeReport> &report);

// Sets `reflectance`, and the coefficients of `material` that follow from it. Call it when the images that do not exist
// have lost their names.
void finish_reflectance(NamedMaterial &named);

} // namespace pbm::build
