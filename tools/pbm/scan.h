// The door of pbm::scan: reads a scan of any known format as one Surface, that is as plain arrays.
//
// A complete program that prints the size of a scan, its extent, and what of the file has no place in a Surface:
// read_scan FILE. It links pbm::scan.
//
//   #include <pbm/scan.h>
//
//   #include <glm/common.hpp>
//
//   #include <cstdio>
//
//   int main(int argc, char **argv) {
//       if (argc != 2)
//           return 1;
//       const auto scan = pbm::build::read_surface(argv[1], {});
//       if (!scan) {
//           std::fprintf(stderr, "%s: %s\n", argv[1], scan.error().message.c_str());
//           return pbm::exit_code(scan.error().code);
//       }
//       glm::dvec3 low = scan->positions[0], high = low; // a scan has a vertex, and all of them are finite
//       for (const glm::dvec3 &position : scan->positions) {
//           low = glm::min(low, position);
//           high = glm::max(high, position);
//       }
//       std::printf("%zu vertices, %zu triangles\n", scan->positions.size(), scan->triangles.size());
//       std::printf("x %.9g..%.9g, y %.9g..%.9g, z %.9g..%.9g\n", low.x, high.x, low.y, high.y, low.z, high.z);
//       for (const pbm::build::AttributeReport &line : scan->report)
//           if (line.fate == pbm::build::Fate::dropped)
//               std::printf("dropped: %s (%s)\n", line.name.c_str(), line.note.c_str());
//   }
//
// Contents
//   reading  read_surface: from a file, from a stream ("-"), or from memory;   pbm_scan/surface_reader.h
//            further_files, find_format
//   scans    Surface: positions, triangles, normals, colours, radii, images,   pbm_scan/surface/surface.h
//            materials, fields, positions of the scanner; ReadOptions
//   report   AttributeReport: the fate of each attribute of the file           pbm_scan/surface/attribute_report.h
//
// Readers believe no count of a file before they have compared it with the bytes that are there: a damaged or cut file
// is an error, never a smaller surface. Errors are values, as in pbm/format.h. Functions throw at most std::bad_alloc.
//
// Stability: stable. What a header marked so declares keeps compiling until the next major version. What one marked
// experimental declares may change with a minor version. docs/reference/versions.md
#pragma once

#include "pbm_scan/surface/surface.h"
#include "pbm_scan/surface_reader.h"
