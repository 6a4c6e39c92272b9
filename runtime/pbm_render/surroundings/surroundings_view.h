// The surroundings in one frame, as rows of pixels.
//
//   const SurroundingsView view(surroundings, appearance, projection, options)    per frame
//   view.draw_row(..) or view.look(..)                                            rows of pixels, on several threads
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/camera/projection.h"
#include "pbm_render/surroundings/ground_sampler.h"
#include "pbm_render/surroundings/panorama_sampler.h"
#include "pbm_render/surroundings/surroundings.h"

#include <cstdint>
#include <vector>

namespace pbm {

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
    void sample_background(const RayRow &rays, double y, SurroundingsRow &row) const;

    const Projection &projection_;
    const PanoramaSampler *panorama_ = nullptr; // behind everything
    const PanoramaSampler *mirrored_ = nullptr; // in materials that ask for it
    const GroundSampler *ground_ = nullptr;
    GroundFrame ground_frame_;
    const RenderOptions options_;
};

} // namespace pbm
