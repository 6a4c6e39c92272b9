// What every renderer is asked for and what it answers.
#pragma once

#include "pbm_format/model/octree.h"
#include "pbm_render/picture/framebuffer.h"

#include <cstdint>

namespace pbm {

// fast: one sample per pixel, one look per point. fine: points blended, every pixel shaded, several samples.
enum class Quality : std::uint8_t { fast, fine };

// Darkens what lies behind its surroundings, from the z-buffer alone.
enum class DepthCue : std::uint8_t { none, eye_dome, ambient_occlusion };

// What the reference renderer draws points as: exact images of discs, or the dissertation's table of stencils.
enum class Splats : std::uint8_t { ellipses, kernels };

// What the file does not have is left out, whatever is asked for.
struct RenderOptions {
    int level = kMaxDepth;             // detail level; beyond the finest one there is: the finest
    Rgba8 background{51, 51, 51, 255}; // sRGB; where there is no panorama
    bool texture = true;               // points and ground plane have the colours of their solid texture
    bool point_colours = true;         // without texture; else every point has the colour of its material
    bool shadows = true;               // else every light reaches every point
    bool panorama = true;              // behind everything
    bool ground = true;                // the ground plane is drawn
    bool reflections = true;           // of the panorama, where materials ask for it
    DepthCue depth_cue = DepthCue::none;
    Quality quality = Quality::fast;
    Splats splats = Splats::ellipses;
    int samples = 8; // per pixel of fine pictures, 1..64
};

struct RenderStatistics {
    int level = 0;                  // drawn; the finest one where they are mixed
    std::uint64_t points = 0;       // of all that was to be drawn
    std::uint64_t drawn_points = 0; // facing the eye and in front of it
};

} // namespace pbm
