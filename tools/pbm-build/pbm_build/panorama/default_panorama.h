// The surroundings of models that bring none: an open plain under a bright sky, procedural. BVG.md section 3.10
#pragma once

#include "pbm_format/model/image.h"

#include <cstdint>

namespace pbm::build {

inline constexpr std::uint32_t kDefaultPanoramaWidth = 2048;

// Equirectangular, `width` x `width` / 2, 3 channels, sRGB, as ModelImages::panorama: the middle is what the default
// camera looks at, up is up, whatever the model's up axis. The sun stands behind that camera, to its left. Width: a
// power of two, 16..16384. The same bytes for any number of threads.
Image default_panorama(std::uint32_t width, int threads);

} // namespace pbm::build
