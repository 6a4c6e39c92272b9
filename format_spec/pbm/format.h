// The door of pbm::format: reads, checks and writes binary voxel grids. BVG.md specifies the format.
//
// A complete program that prints the points of a detail level, one "x y z" per line: read_points FILE.pbvg [LEVEL].
// It links pbm::format.
//
//   #include <pbm/format.h>
//
//   #include <cstdio>
//   #include <cstdlib>
//
//   int main(int argc, char **argv) {
//       const auto fail = [](const pbm::Error &error) {
//           return std::fprintf(stderr, "%s\n", error.message.c_str()), pbm::exit_code(error.code);
//       };
//       if (argc < 2)
//           return 1;
//       const auto file = pbm::MappedFile::open(argv[1]); // owns the bytes; everything below only views them
//       if (!file)
//           return fail(file.error());
//       auto reader = pbm::Reader::open(file->bytes());
//       if (!reader)
//           return fail(reader.error());
//       const auto model = pbm::load_model(*reader, {.max_level = argc > 2 ? std::atoi(argv[2]) : reader->depth()});
//       if (!model)
//           return fail(model.error());
//       std::vector<pbm::MortonCode> voxels{0}; // of level 0; each level's masks give those of the next one
//       for (std::size_t level = 1; level < model->levels.size(); ++level)
//           voxels = *pbm::expand_level(voxels, model->levels[level].masks, model->levels[level].points.size());
//       const pbm::Grid &grid = model->parameters.grid;
//       const double edge = grid.voxel_size_at(static_cast<int>(model->levels.size()) - 1);
//       for (const pbm::MortonCode voxel : voxels) {
//           const auto [x, y, z] = pbm::morton_decode(voxel);
//           std::printf("%.9g %.9g %.9g\n", grid.origin[0] + (x + 0.5) * edge, grid.origin[1] + (y + 0.5) * edge,
//                       grid.origin[2] + (z + 0.5) * edge);
//       }
//   }
//
// Contents
//   files     MappedFile, replace_file; SparseFile for ranges   system/files/, system/byte_source.h
//   reading   Reader (chunk by chunk), load_model               pbm_format/reading/
//   models    Model, morton_encode, encode_octree,              pbm_format/model/
//             normals, colours, radii, average_levels
//   rasters   TiledImage                                        pbm_format/rasters/
//   checking  verify (the first error), validate (all)          pbm_format/checking/
//   writing   encode_model, write_model, edit_model             pbm_format/writing/
//
// Bytes passed to functions must start at a multiple of 8 in memory, as mappings and vectors do.
//
// Errors are values: Result<T> and Status (system/error.h) hold the error, its byte offset and the broken rule of
// BVG.md. Functions that return one throw nothing; all others throw at most std::bad_alloc.
//
// Stability: stable. What a header marked so declares keeps compiling until the next major version. What one marked
// experimental declares may change with a minor version. docs/reference/versions.md
#pragma once

#include "pbm_format/checking/validate.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/model_edit.h"
#include "pbm_format/writing/writer.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"
