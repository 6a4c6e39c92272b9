// What every renderer is asked for and what it answers.
#pragma once

#include "pbm_format/octree.h"
#include "pbm_render/framebuffer.h"

#include <cstdint>

namespace pbm {

struct RenderOptions {
    int level = kMaxDepth;             // detail level; beyond the finest one there is: the finest
    Rgba8 background{51, 51, 51, 255}; // sRGB
    bool point_colours = true;         // else every point has the colour of its material
};

struct RenderStatistics {
    int level = 0;                  // drawn; the finest one where they are mixed
    std::uint64_t points = 0;       // of all that was to be drawn
    std::uint64_t drawn_points = 0; // facing the eye and in front of it
};

} // namespace pbm
