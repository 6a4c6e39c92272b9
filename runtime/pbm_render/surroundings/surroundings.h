// The surroundings of the object: the ground plane under it and the panorama behind everything, or the background
// colour where there is none. One ray lookup per pixel, all in linear light.
//
//   Surroundings surroundings(parameters, images)     once for a model, shared by its renderers; `images` come from
//                                                     read_images(reader) or TiledImages::of(model.images)
//   SurroundingsView (surroundings_view.h)            per frame: rows of pixels, on several threads
//
// The panorama is infinitely far away. Sampling is bilinear in the mip levels that fit a pixel's angle, and wraps at
// the seam. The ground plane is a square with an anti-aliased border. It is visible from above only, since from below
// it would hide the object. Every light shades it (Phong per pixel, times the lit fraction), and it mirrors the
// panorama as its material asks.
// Based on: dissertation sections 4.5 and 4.6; Williams. Pyramidal parametrics. 1983 (mip levels); Igehy. Tracing ray
// differentials. 1999 (footprints)
// Stability: stable.
#pragma once

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_render/surroundings/frame_surroundings.h"

#include <memory>
#include <vector>

namespace pbm {

class GroundSampler;
class PanoramaSampler;

// Reads texels tile by tile when a picture first shows them. Several threads may use it at once; pictures are the same
// for any number of them.
class Surroundings final : public ModelSurroundings {
  public:
    // `parameters` must outlive the surroundings.
    Surroundings(const ModelParameters &parameters, TiledImages images);
    ~Surroundings() override;
    Surroundings(const Surroundings &) = delete;
    Surroundings &operator=(const Surroundings &) = delete;

    std::unique_ptr<const FrameSurroundings> in_frame(const Appearance &appearance, const Projection &projection,
                                                      const RenderOptions &options) const override;
    bool has_panorama() const { return panorama_ != nullptr; }

    // Errors of the damaged tiles found since the last call, each once. Pictures show coarser mip levels in their
    // place.
    std::vector<Error> take_errors() const;
    // File ranges of the tiles that pictures since the last call needed before their bytes had arrived, coarse to fine.
    // These pictures show coarser mip levels in their place; the next picture tries the tiles again. Must not be called
    // while a picture is drawn.
    std::vector<FileRange> take_wanted() const;

  private:
    friend class SurroundingsView;

    const ModelParameters &parameters_;
    const TiledImages images_;
    std::unique_ptr<const PanoramaSampler> panorama_; // null: none
    std::unique_ptr<const GroundSampler> ground_;     // null: none
};

} // namespace pbm
