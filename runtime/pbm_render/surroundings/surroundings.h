// What is seen around the object: the ground plane under it, the panorama behind everything, the background colour
// where there is none. Ray lookups per pixel, all in linear light.
//
//   Surroundings surroundings(parameters, images)     once for a model, shared by its renderers: of Reader::images()
//                                                     or TiledImages::of(model.images)
//   const SurroundingsView view(surroundings, appearance, projection, options)              per frame
//   view.draw_row(..) or view.look(..)                                     rows of pixels, on several threads
//
// The panorama is infinitely far away: bilinear in the mip levels that fit a pixel's angle; it wraps at the seam.
// The ground plane is a square that is seen from above only, since from below it would hide the object; its border is
// anti-aliased. It is lit by every light, Phong per pixel, each light by its lit fraction; it mirrors the panorama as
// its material asks.
// Based on: dissertation sections 4.5 and 4.6; Williams. Pyramidal parametrics. 1983 (mip levels);
//           Igehy. Tracing ray differentials. 1999 (footprints)
#pragma once

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/camera/transform_table.h"
#include "pbm_render/picture/render_options.h"
#include "pbm_render/surroundings/ground_sampler.h"
#include "pbm_render/surroundings/panorama_sampler.h"

#include <memory>
#include <optional>
#include <vector>

namespace pbm {

// Texels are read and made ready when a picture first sees them, tile by tile. Safe to use from several threads; the
// same for any number of them.
class Surroundings {
  public:
    // `parameters` must stay as long as the surroundings.
    Surroundings(const ModelParameters &parameters, TiledImages images);
    Surroundings(const Surroundings &) = delete;
    Surroundings &operator=(const Surroundings &) = delete;

    bool has_panorama() const { return panorama_.has_value(); }
    bool has_ground() const { return ground_.has_value(); }

    // Tiles that were found damaged since the last call, each once. Pictures show coarser mip levels in their place.
    std::vector<Error> take_errors() const;
    // Where the tiles lie in the file that pictures since the last call lacked, since they are not there yet: coarse to
    // fine. Coarser mip levels were shown in their place; the next picture looks for them again. Not while a picture is
    // drawn.
    std::vector<FileRange> take_wanted() const;

  private:
    friend class SurroundingsView;
    template <class Use> void for_images(Use &&use) const;

    const ModelParameters &parameters_;
    const TiledImages images_;
    std::optional<PanoramaSampler> panorama_;
    std::optional<GroundSampler> ground_;
};

// A row of pixels, linear light, straight alpha: [pixels], with room behind for whole blocks. Keep it and hand it in
// again: memory is reused.
struct SurroundingsRow {
    std::vector<float> red, green, blue, alpha;
    std::vector<float> depth;    // grid edges, of the nearer of object and ground; +infinity in front of the panorama
    std::vector<float> coverage; // of the pixel by the ground as it is seen

    // To work with:
    std::vector<float> object_depths, mirrored_red, mirrored_green, mirrored_blue;
    std::vector<std::uint8_t> wanted, wanted_ground; // [blocks]
    void resize(std::size_t pixels);
};

// One frame of it.
class SurroundingsView {
  public:
    // `projection` takes the unit grid to the screen. `surroundings` may be null: then there is only the background
    // colour. All arguments must outlive the view.
    SurroundingsView(const Surroundings *surroundings, const Appearance &appearance, const Projection &projection,
                     const RenderOptions &options);
    // Whether rays that miss the object meet nothing but the background colour.
    bool is_plain() const { return panorama_ == nullptr && ground_ == nullptr; }
    // Whether there is a panorama that materials may mirror, and the options want that.
    bool has_reflections() const { return mirrored_ != nullptr; }

    // Looks through `count` points of the screen, one pixel apart from `first` on. `object_depths`: of the object
    // there, grid edges, +infinity where it is not. Where there is an object and no coverage, the row's colours mean
    // nothing.
    void look(glm::dvec2 first, std::size_t count, const float *object_depths, SurroundingsRow &row) const;

    // Puts the surroundings behind the object of a row of pixel centres: `depths` in grid edges x `scale`, +infinity
    // where there is no object and `colours` hold the background. Writes colours, opaque but for the border of the
    // ground, and the depth of the ground where it covers half a pixel; that of the panorama stays +infinity.
    // `scratch`: anything.
    void draw_row(int y, std::size_t width, float scale, std::uint32_t *colours, float *depths,
                  SurroundingsRow &scratch) const;

    // What the panorama sends along a direction, model axes, any length, filtered over an angle (radians). Linear red,
    // green, blue and 0. Needs has_reflections().
    Float4 reflection(glm::vec3 direction, float footprint) const { return mirrored_->sample(direction, footprint); }

  private:
    RayRow rays(glm::dvec2 first) const;
    void look_behind(const RayRow &rays, std::size_t count, SurroundingsRow &row) const;

    const Projection &projection_;
    const PanoramaSampler *panorama_ = nullptr; // behind everything
    const PanoramaSampler *mirrored_ = nullptr; // in materials that ask for it
    const GroundSampler *ground_ = nullptr;
    GroundFrame ground_frame_;
    const Rgba8 background_;
};

} // namespace pbm
