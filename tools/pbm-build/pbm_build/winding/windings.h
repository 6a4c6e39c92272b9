// How the faces of a surface are wound: patches with one winding, and the sheets that they make.
#pragma once

#include "pbm_build/winding/edge_joins.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace pbm::build {

// Of some faces, as they are wound.
struct FaceSums {
    double area = 0, volume = 0; // model units^2 and ^3; volumes of cones to one point for all
    glm::dvec3 vector_area{0};   // normals x areas: 0 for a closed surface
    std::uint64_t faces = 0;
    std::uint64_t agreeing = 0, against = 0; // faces whose given normals agree with them, or do not

    void add(const FaceSums &other, bool turned) {
        area += other.area;
        volume += turned ? -other.volume : other.volume;
        vector_area += turned ? -other.vector_area : other.vector_area;
        faces += other.faces;
        agreeing += turned ? other.against : other.agreeing;
        against += turned ? other.agreeing : other.against;
    }
};

inline constexpr double kVolumeRounding = 1e-9; // of area^(3/2): smaller volumes may be rounding

// A sheet (mesh_repair/sheets.h), with what decides on its winding. Its sign is that of most of its patches: volumes
// are those of its faces with that sign.
struct WoundSheet {
    FaceSums sums;
    std::uint32_t part = 0;
    std::uint64_t open_sides = 0;  // at edges with one face
    std::uint64_t other_sides = 0; // at complex edges, and at those where its windings meet
    double majority = 0;           // area of patches that have the sheet's sign - area of the others
    std::uint32_t patches = 0;
    std::uint32_t face = 0; // one of its faces
    bool is_cut = false;
    bool is_cavity = false; // looks inwards, and is right so

    // It looks outwards or inwards. A sheet that ends at complex edges only has an outside if it is closed by itself.
    bool has_outside() const {
        constexpr double kClear = 0.01, kClosed = 1e-6; // a sphere has 0.094; a vector area
        return open_sides == 0 &&
               (other_sides == 0 || (glm::length(sums.vector_area) < kClosed * sums.area &&
                                     std::fabs(sums.volume) > kClear * sums.area * std::sqrt(sums.area)));
    }
    bool is_inward() const {
        return has_outside() && sums.volume < -kVolumeRounding * sums.area * std::sqrt(sums.area);
    }
};

// The mesh as it was read.
struct Windings {
    EdgeJoins joins;
    std::vector<FaceSums> patches;
    std::vector<std::uint32_t> sheet_of; // [patches]
    std::vector<std::uint8_t> opposite;  // [patches] 1: to the sign of its sheet
    std::vector<std::array<HalfEdge, 2>> cuts;
    std::vector<WoundSheet> sheets;
    std::size_t parts = 0;

    std::uint32_t sheet_of_face(std::size_t face) const { return sheet_of[joins.patches[face]]; }
};

// Does not depend on the order of vertices and faces, but for the numbers of patches and sheets, nor on the threads.
Windings find_windings(const Surface &surface, int threads);

// Of the patches, as the faces are wound now.
std::vector<FaceSums> sum_patches(const Surface &surface, const EdgeJoins &joins, int threads);

} // namespace pbm::build
