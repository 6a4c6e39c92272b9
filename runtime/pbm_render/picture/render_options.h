// What every renderer takes besides a camera, and what it returns. Options of one renderer stand in its own header.
#pragma once

#include "pbm_render/picture/framebuffer.h"

#include <cstdint>

namespace pbm {

// Whatever these options say, a renderer leaves out what the file does not hold.
struct RenderOptions {
    Rgba8 background{51, 51, 51, 255}; // sRGB; drawn where no panorama is
    bool texture = true;               // points and ground plane have the colours of their solid texture
    bool point_colours = true;         // points without texture have their own colour; false: that of their material
    bool shadows = true;               // false: every light reaches every point
    bool panorama = true;              // the panorama is drawn behind everything
    bool ground = true;                // the ground plane is drawn
    bool reflections = true;           // materials that ask for it reflect the panorama
};

struct RenderStatistics {
    int level = 0;                  // detail level that was drawn; where levels are mixed, the finest one
    std::uint64_t points = 0;       // points that the picture was made of
    std::uint64_t drawn_points = 0; // points of these that face the eye and lie in front of it
};

} // namespace pbm
