// The surroundings of the object: the ground plane under it and the panorama behind everything, or the background
// colour where there is none. One ray lookup per pixel, all in linear light.
//
//   Surroundings surroundings(parameters, images)     once for a model, shared by its renderers: of read_images(reader)
//                                                     or TiledImages::of(model.images)
//   const SurroundingsView view(surroundings, appearance, projection, options)              per frame
//   view.draw_row(..) or view.look(..)                                     rows of pixels, on several threads
//
// The panorama is infinitely far away. Sampling is bilinear in the mip levels that fit a pixel's angle, and wraps at
// the seam. The ground plane is a square with an anti-aliased border. It is visible from above only, since from below
// it would hide the object. Every light shades it (Phong per pixel, times the lit fraction), and it mirrors the
// panorama as its material asks. Based on: dissertation sections 4.5 and 4.6; Williams. Pyramidal parametrics. 1983
// (mip levels);
//           Igehy. Tracing ray differentials. 1999 (footprints)
#pragma once

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_render/surroundings/frame_surroundings.h"
#include "pbm_render/surroundings/ground_sampler.h"
#include "pbm_render/surroundings/panorama_sampler.h"

#include <memory>
#include <optional>
#include <vector>

namespace pbm {

// Reads texels tile by tile when a picture first shows them. Several threads may use it at once; pictures are the same
// for any number of them.
class Surroundings final : public ModelSurroundings {
  public:
    // `parameters` must outlive the surroundings.
    Surroundings(const ModelParameters &parameters, TiledImages images);
    Surroundings(const Surroundings &) = delete;
    Surroundings &operator=(const Surroundings &) = delete;

    std::unique_ptr<const FrameSurroundings> in_frame(const Appearance &appearance, const Projection &projection,
                                                      const RenderOptions &options) const override;
    bool has_panorama() const { return panorama_.has_value(); }

    // The damaged tiles that were found since the last call, each once. Pictures show coarser mip levels in their
    // place.
    std::vector<Error> take_errors() const;
    // Where the tiles lie in the file that pictures since the last call lacked, since they are not there yet: coarse to
    // fine. Coarser mip levels were shown in their place; the next picture looks for them again. Not while a picture is
    // drawn.
    std::vector<FileRange> take_wanted() const;

  private:
    friend class SurroundingsView;

    const ModelParameters &parameters_;
    const TiledImages images_;
    std::optional<PanoramaSampler> panorama_;
    std::optional<GroundSampler> ground_;
};

// A row of pixels in linear light with straight alpha: [pixels], with room behind for whole blocks. Callers keep it, so
// that its memory is reused.
struct SurroundingsRow {
    std::vector<float> red, green, blue, alpha;
    std::vector<float> depth;    // grid edges, of the nearer of object and ground; +infinity in front of the panorama
    std::vector<float> coverage; // of the pixel by the ground as it is seen

    // Scratch:
    std::vector<float> object_depths, mirrored_red, mirrored_green, mirrored_blue;
    std::vector<std::uint8_t> wanted, wanted_ground; // [blocks]
    void resize(std::size_t pixels);
};

// The surroundings in one frame.
class SurroundingsView final : public FrameSurroundings {
  public:
    // `projection` takes the unit grid to the screen. `surroundings` may be null: then all is background colour. All
    // arguments must outlive the view.
    SurroundingsView(const Surroundings *surroundings, const Appearance &appearance, const Projection &projection,
                     const RenderOptions &options);
    // Whether rays that miss the object meet nothing but the background colour.
    bool is_plain() const { return panorama_ == nullptr && ground_ == nullptr; }
    bool has_reflections() const override { return mirrored_ != nullptr; }
    Float4 reflection(glm::vec3 direction, float footprint) const override {
        return mirrored_->sample(direction, footprint);
    }
    void draw_behind(Framebuffer &target, float edge) const override;

    // Casts rays through `count` points of the screen, one pixel apart from `first` on. `object_depths` are those of
    // the object, grid edges, +infinity where it is not. Colours of pixels with an object and without coverage are
    // undefined.
    void look(glm::dvec2 first, std::size_t count, const float *object_depths, SurroundingsRow &row) const;

    // Draws the surroundings behind the object into row `y` of a picture. `row` has depths: +infinity marks a pixel
    // without object, whose colour is the background. Writes colours, opaque but for the border of the ground, and
    // the depth of the ground where it covers at least half a pixel; the panorama leaves +infinity. The contents of
    // `scratch` do not matter.
    void draw_row(int y, const PixelRow &row, SurroundingsRow &scratch) const;

  private:
    RayRow rays(glm::dvec2 first, std::size_t count) const;
    GroundRow ground_row(glm::dvec2 first, std::size_t count) const; // empty where there is no ground
    void look(glm::dvec2 first, std::size_t count, const float *object_depths, const GroundRow &ground,
              SurroundingsRow &row) const;
    void look_behind(const RayRow &rays, SurroundingsRow &row) const;

    const Projection &projection_;
    const PanoramaSampler *panorama_ = nullptr; // behind everything
    const PanoramaSampler *mirrored_ = nullptr; // in materials that ask for it
    const GroundSampler *ground_ = nullptr;
    GroundFrame ground_frame_;
    const Rgba8 background_;
};

} // namespace pbm
