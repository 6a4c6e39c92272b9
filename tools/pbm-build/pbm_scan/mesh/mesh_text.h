// Verifies OBJ, OFF and STL files before OpenMesh reads them. OpenMesh 9 accepts truncated files, skips lines that it
// cannot parse (so that indices shift), loops on wrong counts and rounds to float; these checks prevent all of that.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// A face as in the text.
struct FaceOutline {
    std::uint64_t face = 0; // how many faces (as MeshText counts them) come before it
    std::vector<std::uint32_t> corners;
};

// A material of an OBJ, from a face on.
struct MaterialRun {
    std::uint64_t first_face = 0; // as MeshText counts them
    std::uint16_t material = 0;
};
constexpr std::uint16_t kNoMaterial = std::numeric_limits<std::uint16_t>::max();

// The name of the report lines of `mtllib` begins so.
constexpr std::string_view kMaterialsLine = "materials and textures ";

struct MeshText {
    // A copy of the file for OpenMesh. Blanked: everything that it would misread, or that would make it open other
    // files (comments, continued lines, texture coordinates, materials, non-finite numbers). ASCII STL is rewritten
    // with vertex numbers in place of coordinates.
    std::string for_openmesh;
    bool binary = false; // STL

    std::uint64_t vertices = 0;        // OpenMesh must find as many as these (not in binary STL)
    std::uint64_t faces = 0;           // of three or more different corners
    std::uint64_t triangles = 0;       // of these, degenerate ones included
    std::vector<glm::dvec3> positions; // in double precision, of OBJ and OFF may be not finite; not of binary STL
    std::vector<glm::vec3> colours;    // OBJ, OFF: as in the file; empty unless every vertex has one
    std::string colour_note;           // their origin, if the vertices of the file have none
    std::vector<glm::vec3> normals;    // NOFF; OBJ: unless faces name them
    std::uint64_t dropped_triangles =
        0; // faces with fewer than three different corners, STL facets that are not finite
    // Faces of OBJ that pass a vertex more than once (a slit to a hole), in their order: OpenMesh's reader removes the
    // second occurrence and with it a part of the polygon. And faces of more than kMaxCorners, of which OpenMesh gets a
    // triangle in their place.
    std::vector<FaceOutline> outlines;
    std::vector<std::string> materials; // OBJ: by name, at most kNoMaterial
    std::vector<MaterialRun> material_runs;
    std::vector<AttributeReport> report;
};

constexpr std::uint64_t kMaxVertices = std::numeric_limits<std::int32_t>::max();
constexpr std::size_t kMaxCorners = 4096; // of a face for OpenMesh, which compares each corner with every other one

// Lines end in LF, CR LF or CR; a byte order mark is skipped.
//
// errors  bad_input            NUL bytes; text that is no number, index or statement; an index out of range; counts (of
//                              OFF, of binary STL, in comments of OBJ) or an end line that do not fit the file
//         too_large            more than 2^31 - 1 vertices
//         unsupported_feature  binary or four-dimensional OFF
Result<MeshText> check_obj(std::span<const std::uint8_t> bytes);
Result<MeshText> check_off(std::span<const std::uint8_t> bytes);
Result<MeshText> check_stl(std::span<const std::uint8_t> bytes);

} // namespace pbm::build
