// The winding of the faces of a mesh: examines the winding of every mesh, and corrects it where it can be determined.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

struct WindingRequest {
    bool keep = false;      // --no-orient-faces: corrects nothing; `flip` still works
    bool requested = false; // --orient-faces: corrects also if `flip` is set, before it; always reports
    bool flip = false;      // --flip-faces: reverses all faces; corrects nothing unless `requested`
};

// Gives all faces of a sheet (sheets.h) the same winding. A sheet is closed if it has_outside() (windings.h):
//
//   closed       Its fronts are outside. A sheet whose fronts are inside stays as it is if a closed sheet with its
//                fronts outside encloses it: it is the wall of a cavity.
//   open         It stays as it is if its faces have one winding. Otherwise it gets the winding with which most given
//                normals agree; without normals it gets that of the larger area.
//   one-sided    A Moebius strip keeps the edges at which two windings meet. Their vertices become two-sided.
//
// Normals: turn_faces turns those of reversed faces. If most given normals of a closed sheet point inwards, all of them
// are turned. In a sheet whose faces had both windings, normals that contradict the faces are removed; vertex_normals.h
// then computes them anew.
//
// Sets surface.closed. Texture coordinates and all other attributes of corners follow their faces. The result does not
// depend on the order of vertices and faces, nor on the number of threads. The windings of a mesh of more than
// kMaxMeshFaces faces are not examined; `flip` reverses them all the same.
void wind_faces(Surface &surface, const WindingRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
