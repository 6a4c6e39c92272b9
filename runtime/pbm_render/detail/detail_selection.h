// Chooses the points of a picture: it shows every place of the model once, at the detail level that its distance needs.
// Based on: Rusinkiewicz, Levoy. QSplat. 2000 (level by projected size, cones of normals)
//
//   level 8    |---------- A ----------|
//   level 9    |---- B ----|---- C ----|     A is too coarse, B fine enough, C too coarse
//   level 10               |- D -|- E -|     E is resident; D is not: C shows its place
//
//   runs: B, the points of C above D, E        missing: D
//
// Chunks nest (BVG.md 5.1), so the runs show every place exactly once.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_render/bricks/point_run.h"
#include "pbm_render/detail/detail_view.h"
#include "pbm_render/detail/resident_chunk.h"

#include <span>
#include <vector>

namespace pbm {

// Cache state of one chunk.
struct ChunkSlot {
    ResidentPointer chunk;       // null: not resident
    std::uint64_t last_view = 0; // number of the last view that needed it
    std::uint32_t children = 0;  // chunks that nest in it and are resident or being loaded
    bool is_loading = false;
    bool refused = false; // damaged: neither it nor the chunks below it are requested
};

// Cache state of one level.
struct LevelState {
    const LevelDirectory *directory = nullptr; // verified
    std::vector<ChunkSlot> chunks;             // [chunks of the directory]; resident only if their parents are
};

struct DetailSelection {
    std::vector<PointRun> runs;        // what to draw now, in Morton order
    std::vector<ChunkPlace> present;   // resident and needed: the chunks of the runs, and their ancestors
    std::vector<MissingChunk> missing; // what the picture lacks, most urgent (largest error) first: parents before
                                       // children, near before far
    bool needs_directory = false;      // the picture may need chunks of the first level without a known directory
};

// `levels` [0] is unused; the levels with known directories follow from level 1 on. `root_radius` is the radius index
// of the model as one point. The selection leaves out chunks outside the view and chunks whose whole normal cone faces
// away, unless backs are shown. Its time grows with the number of chunks whose parents are too coarse.
DetailSelection select_detail(const ModelParameters &parameters, std::uint8_t root_radius,
                              std::span<const LevelState> levels, const DetailView &view);

} // namespace pbm
