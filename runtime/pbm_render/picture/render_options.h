// Options that every renderer takes, and statistics that it returns. Options of one renderer are in its own header.
#pragma once

#include "pbm_render/picture/framebuffer.h"

#include <cstdint>

namespace pbm {

// A renderer leaves out what the file does not hold, whatever these options say.
struct RenderOptions {
    Rgba8 background{51, 51, 51, 255}; // sRGB; drawn where there is no panorama
    bool texture = true;               // draw points and ground plane in the colours of their solid texture
    bool point_colours = true; // draw points without texture in their own colour; false: in that of their material
    bool shadows = true;       // false: every light reaches every point
    bool panorama = true;      // the panorama is drawn behind everything
    bool ground = true;        // the ground plane is drawn
    bool reflections = true;   // materials with an environment factor reflect the panorama
    bool operator==(const RenderOptions &) const = default;
};

struct RenderStatistics {
    int level = 0;                  // finest detail level drawn
    std::uint64_t points = 0;       // points of all runs
    std::uint64_t drawn_points = 0; // those that face the eye and lie in front of it
};

} // namespace pbm
