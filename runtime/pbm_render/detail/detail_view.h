// A view that asks for a picture, and a chunk that the picture lacks.
// Stability: stable.
#pragma once

#include "pbm_format/model/octree.h"
#include "pbm_render/camera/camera.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace pbm {

// Defaults of DetailView::max_error, pixels. A fast picture shows one of the points in a pixel, so smaller voxels make
// fine pictures truer, but not fast ones (docs/explanation/fidelity.md).
inline constexpr double kFastMaxError = 2, kFineMaxError = 1.42;
// A fine picture that is smaller than 1280x720 shows the voxels that one of that size would show: a coarse voxel
// averages normals, which makes it brighter, and covers its children, which makes thin bars wider.
inline constexpr double kFineEdge = 960; // pixels: square root of 1280 x 720
inline double default_max_error(bool fine, int width = 1280, int height = 720) {
    if (!fine)
        return kFastMaxError;
    return kFineMaxError * std::min(1.0, std::sqrt(static_cast<double>(width) * height) / kFineEdge);
}

struct DetailView {
    Camera camera;                    // usable
    int width = 0, height = 0;        // pixels
    double max_error = kFastMaxError; // pixels, > 0: largest edge on the screen of a drawn voxel that has children
    int finest = kMaxDepth;           // the finest level that may be drawn, 1 or more
    bool operator==(const DetailView &) const = default;
};

// A chunk's level, and its index within the directory of that level.
struct ChunkPlace {
    int level = 1;
    std::uint32_t index = 0;
    bool operator==(const ChunkPlace &) const = default;
};

struct MissingChunk {
    ChunkPlace place;
    double error = 0;      // pixels: upper bound of its voxels' edge on the screen; infinite around the eye
    bool is_shown = false; // the picture shows its points, and no chunk below it
};

} // namespace pbm
