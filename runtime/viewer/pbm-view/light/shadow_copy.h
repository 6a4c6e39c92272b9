// A copy of a model that shadows are baked with, apart from the chunks that pictures show.
#pragma once

#include "pbm_bake/shadow_baker.h"
#include "pbm_format/model/model.h"
#include "pbm_render/appearance/appearance.h"
#include "system/bytes.h"
#include "system/error.h"

#include <atomic>
#include <memory>

namespace pbm {

// New shadows of one light: for pictures, and as a file stores them.
struct BakedShadows {
    Light light; // in the place that they belong to
    std::shared_ptr<const LitFractions> fractions;
    Image ground; // empty if the file has no raster for the light
};

// The lit fractions of the finest points as a file stores them, 0..2^bits - 1.
Bytes stored_fractions(const LitFractions &fractions, int bits);

class ShadowCopy {
  public:
    // Loads the finest level of `file`. `max_memory` bounds all that the copy and baking allocate.
    //
    // errors  as load_points; memory, before anything is loaded
    static Result<std::unique_ptr<ShadowCopy>> load(ByteView file, int threads, std::uint64_t max_memory);

    // Bakes hard shadows of light number `index` with the bits and rasters of the file: the file does not say how large
    // a light is. Null if `stop` became true meanwhile.
    //
    // throws  std::bad_alloc
    std::shared_ptr<const BakedShadows> bake(const Light &light, std::size_t index, int threads,
                                             const std::atomic<bool> &stop) const;

  private:
    explicit ShadowCopy(Model model, std::vector<std::uint32_t> ground_edges, int threads);

    Model model_;                             // masks of all levels; normals and radii of the finest one
    std::vector<std::uint32_t> ground_edges_; // texels, by light with a raster
    ShadowCasters casters_;
};

} // namespace pbm
