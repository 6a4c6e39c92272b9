// Draws the ground plane row by row: its coverage of each pixel, and its colour in linear light.
// Based on: Phong. Illumination for Computer Generated Pictures. 1975; Williams. Pyramidal parametrics. 1983
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/projection.h"
#include "pbm_render/surroundings/texel_levels.h"

#include <glm/mat3x3.hpp>

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace pbm {

struct Appearance;

// A light in coordinates of the plane: u and v along its sides, h upwards; unit: the square's edge; origin: its least
// corner.
struct GroundLight {
    LightKind kind;
    glm::vec3 colour;    // linear intensity
    glm::vec3 place;     // position; of a directional light the unit vector towards it
    glm::vec3 direction; // of a spot
    float exponent;
    int word, byte; // lit fraction: this byte of the texels of GroundFrame::lit[word]; word -1: 1 everywhere
};

// What stays the same for a frame.
struct GroundFrame {
    bool is_seen = false; // from above
    glm::vec3 eye;
    glm::dmat3 axes; // from model axes and grid edges to those of the plane
    // Distance in pixels from the square's four sides and the horizon, inwards: a line . (x, y, 1).
    std::array<glm::dvec3, 5> lines;

    Material material;
    float mirror = 0;                         // blending factor of what `mirrored` rows hold
    bool has_texture = false;                 // else:
    glm::vec3 colour;                         // linear
    std::array<std::uint32_t, 257> palette{}; // pack_roots, the last one twice
    std::array<GroundLight, kMaxLights> lights;
    std::size_t light_count = 0;
    std::vector<const TexelLevels *> lit; // those that `lights` name, at most kMaxLights
};

// One row of pixels: its rays in coordinates of the plane, and GroundFrame::lines along it.
struct GroundRow {
    glm::vec3 first, step, down;    // ray of the first pixel; steps to the next pixel and to the next row
    std::array<glm::vec2, 5> lines; // value at the first pixel; step to the next pixel
    std::size_t begin = 0, end = 0; // only pixels begin .. end - 1 may be covered
};

// [pixels], with room behind for whole blocks.
struct GroundPixels {
    const float *object_depths; // grid edges
    float *coverage, *depths;   // 0..1, 0 where the object is nearer; grid edges
    float *red, *green, *blue, *alpha;
    const float *mirrored_red, *mirrored_green, *mirrored_blue;
};

class GroundSampler {
  public:
    GroundSampler(const ModelParameters &parameters, const TiledImages &images);

    GroundFrame frame(const Appearance &appearance, const Projection &projection, bool shadows, bool texture) const;
    static GroundRow row(const GroundFrame &frame, const Projection &projection, glm::dvec2 first, std::size_t count);

    // Fills coverage and depths of a row's pixels begin .. end - 1, rounded to blocks. Sets wanted[i] if the ground
    // covers a pixel of block i.
    static void find_covered(const GroundFrame &frame, const GroundRow &row, const GroundPixels &pixels,
                             std::uint8_t *wanted);
    // Blends the ground over the colours of the wanted blocks.
    void shade(const GroundFrame &frame, const GroundRow &row, const std::uint8_t *wanted,
               const GroundPixels &pixels) const;

    UpAxis up() const { return parameters_.grid.up; }
    void retry() const;

  private:
    const ModelParameters &parameters_;
    const GroundPlane &plane_;
    std::unique_ptr<const TexelLevels> texture_;
    std::vector<std::unique_ptr<const TexelLevels>> lit_;
    std::vector<std::array<int, 2>> lit_places_; // [lights with a raster]: word, byte
};

} // namespace pbm
