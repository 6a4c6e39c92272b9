// One chunk of a mapped file: its streams are used in place and verified at first touch. BVG.md 5.10 and 5.11
#pragma once

#include "pbm_format/chunks/brick_index.h"
#include "pbm_format/chunks/chunk.h"
#include "pbm_format/chunks/stream_rules.h"

namespace pbm {

// The brick records of a chunk in a mapped file; `bricks` is its level's section of bricks.
FileRange brick_range(const ChunkEntry &entry, const SectionEntry &bricks);

// Views the chunk `entry` of a mapped file, whose directory was verified. Verifies nothing.
ChunkView view_chunk(const ChunkEntry &entry, const ChunkBytes &bytes, const AttributeSet &set, int level);

// Verifies hash, padding, masks, counts, ranges of every attribute, normal cone and bricks of a chunk. `parents` must
// be verified; `bricks` is the level's section. Accesses stay in bounds if bytes change. Error offsets are file
// offsets.
//
// errors  bad_hash (5.6.4), bad_octree (4.2, 4.4), bad_directory (5.11.1), bad_content (5.11.2 to 5.11.4),
//         bad_attribute (5.7 cone, 5.10.1 padding, section 6 values)
Status verify_chunk(const ChunkEntry &entry, const ChunkBytes &bytes, const SectionEntry &bricks,
                    const ChunkRules &rules, const BrickParents &parents);

// Copies a chunk to the form that load_chunk returns.
void copy_chunk(const ChunkView &view, const AttributeSet &set, int level, Chunk &to);

} // namespace pbm
