// How the faces of a surface are wound. A patch (edge_joins.h) is a set of connected faces with one winding. A sheet is
// a set of faces that are connected through edges with two faces; it consists of one or more patches.
#pragma once

#include "pbm_build/winding/edge_joins.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace pbm::build {

// Sums over some faces, as they are wound.
struct FaceSums {
    double area = 0, volume = 0; // model units^2 and ^3; volume: signed tetrahedra from faces to one common point
    glm::dvec3 vector_area{0};   // sum of normal * area, model units^2: 0 for a closed surface
    std::uint64_t faces = 0;
    std::uint64_t agreeing = 0, against = 0; // faces whose given normals agree with their winding, or contradict it

    void add(const FaceSums &other, bool turned) {
        area += other.area;
        volume += turned ? -other.volume : other.volume;
        vector_area += turned ? -other.vector_area : other.vector_area;
        faces += other.faces;
        agreeing += turned ? other.against : other.agreeing;
        against += turned ? other.agreeing : other.against;
    }
};

// Volumes below kVolumeRounding * area^(3/2) may be rounding errors.
inline constexpr double kVolumeRounding = 1e-9;

// A sheet, with the figures that decide its winding. Each patch is wound like the sheet or opposite to it; `sums`
// counts opposite patches with their faces turned.
struct WoundSheet {
    FaceSums sums;
    std::uint32_t part = 0;        // sheets that meet at complex edges (three faces or more) are one part
    std::uint64_t open_sides = 0;  // at edges with one face
    std::uint64_t other_sides = 0; // at complex edges, and at edges where two windings meet
    double majority = 0;           // area of the patches with the sign of its first patch - area of the others
    std::uint32_t patches = 0;     // their number
    std::uint32_t face = 0;        // its first face
    bool is_cut = false;           // two windings meet at an edge whatever is turned, as in a Moebius strip
    bool is_cavity = false;        // looks inwards, and lies in a closed sheet that looks outwards

    // Whether the sheet is closed, so that it looks outwards or inwards. A sheet without open edges that has complex
    // edges counts as closed if its vector area is below kClosed * area, and its volume above kClear * area^(3/2).
    bool has_outside() const {
        constexpr double kClear = 0.01, kClosed = 1e-6; // a sphere has a volume of 0.094 area^(3/2)
        return open_sides == 0 &&
               (other_sides == 0 || (glm::length(sums.vector_area) < kClosed * sums.area &&
                                     std::fabs(sums.volume) > kClear * sums.area * std::sqrt(sums.area)));
    }
    bool is_inward() const {
        return has_outside() && sums.volume < -kVolumeRounding * sums.area * std::sqrt(sums.area);
    }
};

// The windings of a mesh as it was read, before any face is turned.
struct Windings {
    EdgeJoins joins;
    std::vector<FaceSums> patches;
    std::vector<std::uint32_t> sheet_of;       // [patches]
    std::vector<std::uint8_t> opposite;        // [patches] 1: wound opposite to its sheet
    std::vector<std::array<HalfEdge, 2>> cuts; // the two sides of each edge where windings meet whatever is turned
    std::vector<WoundSheet> sheets;
    std::size_t parts = 0; // number of parts

    std::uint32_t sheet_of_face(std::size_t face) const { return sheet_of[joins.patches[face]]; }
};

// Only the numbers of patches and sheets depend on the order of vertices and faces. Nothing depends on the number of
// threads.
Windings find_windings(const Surface &surface, int threads);

// Returns the sums of each patch, [patches], as the faces are wound now.
std::vector<FaceSums> sum_patches(const Surface &surface, const EdgeJoins &joins, int threads);

} // namespace pbm::build
