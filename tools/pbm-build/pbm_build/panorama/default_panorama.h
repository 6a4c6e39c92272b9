// The default panorama, procedural: an open plain under a bright sky. BVG.md 3.10
#pragma once

#include "pbm_format/model/model.h"

#include <cstdint>

namespace pbm::build {

inline constexpr std::uint32_t kDefaultPanoramaWidth = 2048;

// Equirectangular, `width` x `width` / 2, 3 channels, sRGB, as ModelImages::panorama: the default camera looks at the
// middle, for any up axis of the model. The sun is behind that camera, to its left. Width: a power of two, 16..16384.
// The same bytes for any number of threads.
Image default_panorama(std::uint32_t width, int threads);

} // namespace pbm::build
