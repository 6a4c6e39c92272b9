// What OBJ, OFF and STL files say, checked before OpenMesh sees them. OpenMesh 9 accepts cut-short files, skips lines
// it cannot read (so that indices shift), loops on counts that lie and rounds to float; what gets past these checks is
// none of that.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// A face as it stands in the text.
struct FaceOutline {
    std::uint64_t face = 0; // how many faces (as MeshText counts them) come before it
    std::vector<std::uint32_t> corners;
};

struct MeshText {
    // A copy of the file in which everything is blanked that OpenMesh would misread or that would make it open other
    // files: comments, continued lines, texture coordinates, materials, numbers that are not finite. ASCII STL is
    // written anew, with numbers of vertices in place of coordinates.
    std::string for_openmesh;
    bool binary = false; // STL

    std::uint64_t vertices = 0;        // OpenMesh must find as many as these (not in binary STL)
    std::uint64_t faces = 0;           // of three or more different corners
    std::uint64_t triangles = 0;       // of these, degenerate ones included
    std::vector<glm::dvec3> positions; // in double precision, of OBJ and OFF may be not finite; not of binary STL
    std::vector<glm::vec3> colours;    // OBJ, OFF: as in the file; empty unless every vertex has one
    std::string colour_note;           // how they came about, if the vertices of the file have none
    std::vector<glm::vec3> normals;    // NOFF; OBJ: unless faces name them
    std::uint64_t dropped_triangles =
        0; // faces with fewer than three different corners, STL facets that are not finite
    // Faces that pass a vertex more than once (a hole reached by a slit), in their order: OpenMesh's OBJ reader takes
    // the second passage away and with it a part of the polygon.
    std::vector<FaceOutline> outlines;
    std::vector<AttributeReport> report;
};

constexpr std::size_t kMaxCorners = 4096; // of one face: OpenMesh compares each corner with every other one

// Lines may end in LF, CR LF or CR; a byte order mark is passed over.
//
// errors  bad_input            NUL bytes; text that is no number, index or statement; an index out of range; counts (of
//                              OFF, of binary STL, in comments of OBJ) or an end line that do not fit the file
//         too_large            a face of more than kMaxCorners, or more than 2^31 - 1 vertices
//         unsupported_feature  binary or four-dimensional OFF
Result<MeshText> check_obj(std::span<const std::uint8_t> bytes);
Result<MeshText> check_off(std::span<const std::uint8_t> bytes);
Result<MeshText> check_stl(std::span<const std::uint8_t> bytes);

} // namespace pbm::build
