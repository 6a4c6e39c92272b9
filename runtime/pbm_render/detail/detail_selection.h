// Which points make a picture: every place of the model at the detail level that its distance asks for, once.
// Based on: Rusinkiewicz, Levoy. QSplat. 2000 (level by projected size, cones of normals)
//
//   level 8    |---------- A ----------|
//   level 9    |---- B ----|---- C ----|     A is too coarse, B fine enough, C too coarse
//   level 10               |- D -|- E -|     D is not at hand: C shows its place; E is
//
//   runs: B, the points of C above D, E        missing: D
//
// Chunks nest (BVG.md 5.1), so nothing is shown twice and nothing left out.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_render/bricks/point_run.h"
#include "pbm_render/camera/camera.h"

#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace pbm {

inline constexpr double kDefaultMaxError = 1.42; // pixels

// The picture that is wanted.
struct DetailView {
    Camera camera;                       // usable
    int width = 0, height = 0;           // pixels
    double max_error = kDefaultMaxError; // pixels, > 0: no voxel drawn is larger on the screen where a finer level is
    int finest = kMaxDepth;              // no finer level than this, 1 or more
};

// Part of the grid, in units of its edge.
struct Box {
    glm::dvec3 least{0}, most{1}; // corners

    glm::dvec3 centre() const { return (least + most) / 2.0; }
    glm::dvec3 half() const { return (most - least) / 2.0; }
};

// The voxels of a chunk's bricks; one or more.
Box bounds_of(std::span<const BrickRecord> bricks, int level);

// What is known of one chunk.
struct ChunkState {
    const ChunkView *view = nullptr;       // null: not at hand
    const ChunkOffsets *offsets = nullptr; // of its points, for the runs
    Box bounds = {};                       // of its bricks, if it is at hand
    std::uint8_t largest_radius = 0;       // index, of its points, if it is at hand
    bool refused = false;                  // damaged, and so are those below it for who needs it: not to be asked for
};

// What is known of one level.
struct LevelState {
    const LevelDirectory *directory = nullptr; // proven
    std::span<const ChunkState> chunks;        // as many as in the directory; at hand only where their parents are
};

struct ChunkPlace {
    int level = 1;
    std::uint32_t index = 0;
    bool operator==(const ChunkPlace &) const = default;
};

struct MissingChunk {
    ChunkPlace place;
    double error = 0; // pixels: its voxels' edge on the screen, as large as it may be; infinite around the eye
};

struct DetailSelection {
    std::vector<PointRun> runs;        // what to draw now, in Morton order
    std::vector<ChunkPlace> present;   // at hand and of use: those of the runs and all above these
    std::vector<MissingChunk> missing; // what the picture lacks, most urgent (largest error) first: parents before
                                       // children, near before far
    bool needs_directory = false;      // chunks might be missing of the first level without directory
};

// `levels` [0] is unused, then those whose directories are known, from level 1 on; `root_radius` is the radius index of
// the model as one point. Nothing is chosen outside the view, nor where a chunk that would be shown is turned away as a
// whole. Takes time for each chunk whose parent is too coarse, and no other.
DetailSelection select_detail(const Grid &grid, std::uint8_t root_radius, std::span<const LevelState> levels,
                              const DetailView &view);

} // namespace pbm
