// The attributes of a triangle or point in a voxel.
#pragma once

#include "pbm_build/images/triangle_texture.h"
#include "pbm_build/voxels/sample_points.h"
#include "pbm_build/voxels/triangle_mix.h"

#include <span>
#include <vector>

namespace pbm::build {

// Where in its voxel a sample is taken, and how much it counts.
inline constexpr int kPlaceSteps = 1024;
struct SamplePlace {
    std::array<std::int32_t, 3> from_centre; // 1 / kPlaceSteps voxels
    std::int32_t weight;
};
// `nearest`: the triangle's point nearest to the centre, of weight 1. `pieces`: the centroid of the triangle's part in
// the voxel, weighted by its area: several times as much work, and truer where surfaces bend within a voxel.
enum class Places : std::uint8_t { none, nearest, pieces };

// Samples of some hits; `rest` holds the attributes that are common to a source.
struct SampleRows {
    MixedRows mixed;
    std::array<Sample::Rest, MixedRows::kRows> rest{};
    std::vector<std::array<std::int32_t, MixedRows::kRows>> fields; // values of FieldSamples
    std::array<SamplePlace, MixedRows::kRows> places;               // of triangles, if they are asked for
};

// Computes the samples of hits; fastest where hits of one source are consecutive. For one thread.
class SampleCursor {
  public:
    explicit SampleCursor(const SurfaceSampler &sampler)
        : sampler_(sampler), triangle_count_(sampler.surface_.triangles.size()) {}

    // Computes the samples of at most MixedRows::kRows hits, all in the block whose first voxel is `block`.
    // `rows.mixed` has their places on entry, and rounded normals on return.
    void take(std::span<const Hit> hits, const glm::ivec3 &block, SampleRows &rows, Places places);

  private:
    void load(std::uint32_t source);
    void take_point(std::uint32_t source, std::size_t row, SampleRows &rows) const;
    void take_image_colour(std::size_t row, SampleRows &rows) const;
    void load_relief(std::uint32_t source, const std::array<std::size_t, 3> &corners);
    void take_relief(std::size_t row, SampleRows &rows) const;
    // Finds the image of a triangle in a layer. False: it has none.
    bool load_layer(Layer layer, std::uint32_t source, const std::array<std::size_t, 3> &corners, TriangleTexture &to);
    void take_look(std::size_t row, SampleRows &rows) const;
    void take_fields(std::size_t row, SampleRows &rows) const;
    void take_place(const glm::dvec3 &block_centre, std::size_t row, SampleRows &rows, Places places) const;
    void take_triangle(const glm::dvec3 &block_centre, std::size_t first, std::size_t end, SampleRows &rows,
                       Places places) const;

    const SurfaceSampler &sampler_;
    std::size_t triangle_count_;
    std::uint64_t source_ = kMaxSources; // of the triangle; none
    TriangleMix triangle_;
    std::array<std::uint8_t, 3> materials_{}; // of its corners
    std::array<std::uint32_t, 3> vertices_{}; // of its corners
    Sample::Rest rest_;
    bool mixed_materials_ = false;
    bool has_image_ = false;
    TriangleTexture image_;
    std::array<double, 3> opacities_{}; // of its corners, where they fade the image
    bool has_relief_ = false;
    TriangleTexture relief_;
    bool has_reflectance_ = false, has_emission_ = false, has_occlusion_ = false;
    TriangleTexture reflectance_, emission_, occlusion_;
    std::array<glm::dvec3, 3> tangents_{}; // of its corners
    double sense_ = 1;                     // of the third direction of the normal map, normal x tangent
};

} // namespace pbm::build
