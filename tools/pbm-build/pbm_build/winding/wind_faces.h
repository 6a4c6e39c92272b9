// The winding of the faces of a surface: found for every mesh, made right where it can be.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

struct WindingRequest {
    bool keep = false;      // --no-orient-faces: no face is turned but by `flip`
    bool requested = false; // --orient-faces: also with `flip`, which comes after; always reports
    bool flip = false;      // --flip-faces: turns all faces around, and nothing else unless `requested`
};

// Gives the faces of each sheet (sheets.h) one winding: outwards where the sheet has an outside, else that with which
// most given normals agree, or without normals that of most of its area. A sheet that looks inwards stays as it is if a
// closed sheet that looks outwards encloses it: it is the wall of a cavity. An open sheet of one winding stays as it
// is. A sheet with one side only (a Moebius strip) keeps edges at which two windings meet: their vertices become
// two-sided.
//
// The normal of a vertex all of whose faces are turned is turned with them if it agreed with them. Where most given
// normals of a closed sheet point inwards, all of them are turned. In a sheet whose faces were wound in both ways,
// normals that contradict the faces are removed; vertex_normals.h then computes them.
//
// Sets surface.closed. Texture coordinates and all attributes follow. The result does not depend on the order of
// vertices and faces, nor on the number of threads. Of a mesh of more than kMaxMeshFaces faces nothing is found.
void wind_faces(Surface &surface, const WindingRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
