// Which attribute each property of a PLY file stands for. The spellings that are accepted are in ply_roles.cpp.
#pragma once

#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/surface/surface.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace pbm::build {

// The property of each role, as a pointer into the header; null if the file has none. A group of three is complete, or
// all three are null.
struct PlyRoles {
    using Three = std::array<const PlyProperty *, 3>;

    const PlyElement *vertex = nullptr; // never null after resolve_roles
    Three position{}, normal{}, colour{}, face_colour{};
    const PlyProperty *radius = nullptr, *material_index = nullptr;
    std::array<const PlyProperty *, kByteAttributes.size()> bytes{};
    const PlyProperty *material_red = nullptr;                    // of element material
    std::array<const PlyProperty *, 2> place{};                   // u v of a vertex
    const PlyProperty *corner_places = nullptr, *image = nullptr; // of a face
    std::array<const PlyProperty *, 8> splat{}; // scale_0 .. 2, rot_0 .. 3, opacity; scale_2 and opacity may be absent
    bool splat_colours = false;                 // coefficients of spherical harmonics: f_dc_0 f_dc_1 f_dc_2

    std::vector<const PlyProperty *> fields;   // numbers of a vertex that are kept
    const PlyProperty *only_classes = nullptr; // the one of `fields` that is read for --drop-class alone

    std::size_t field_number(const PlyProperty &property) const { // its index in `fields`
        return static_cast<std::size_t>(std::find(fields.begin(), fields.end(), &property) - fields.begin());
    }
    bool has_splats() const { return splat[0] != nullptr; }
    std::size_t splat_number(const PlyProperty &property) const { // its index in `splat`
        return static_cast<std::size_t>(std::find(splat.begin(), splat.end(), &property) - splat.begin());
    }
    std::size_t byte_attribute(const PlyProperty &property) const { // its index in `bytes`
        return static_cast<std::size_t>(std::find(bytes.begin(), bytes.end(), &property) - bytes.begin());
    }
};

// Sets `kind` and `role` of all elements and properties of the header:
//
//   vertex           x y z; nx ny nz; red green blue; radius; material_index; the names of kByteAttributes; u v
//   face, tristrips  vertex_indices; red green blue, texcoord and texnumber of a face
//   range_grid       vertex_indices
//   material         ka kd ks power clr_r clr_g clr_b envmapfactor, as in the dissertation's files; shape, as of
//   pbm-export
//
// u v, texcoord and texnumber are used only if the file names images.
// A group of three counts only if it is complete. Of several spellings of a role the first one in the order of
// ply_roles.cpp is used; the last spelling of red green blue is f_dc_0 f_dc_1 f_dc_2 of Gaussian splats. Colours of
// faces are used only if vertices have none. A range grid is used only if the file has no faces and obj_info gives the
// width and height of the grid.
//
// errors  bad_input  no element vertex, no x y z in it, no vertices at all, or a coordinate that is a list
Result<PlyRoles> resolve_roles(PlyHeader &header);

// Finds the shape of Gaussian splats, if the file has all of it; properties without another role get that of a splat.
void assign_splats(PlyHeader &header, PlyRoles &roles);

// The numeric properties of vertices that may become fields: those without a role.
std::vector<PlyProperty *> free_numbers(PlyHeader &header);

// The reason, for the report, why a property without a role is dropped.
std::string_view drop_reason(const PlyElement &element, const PlyProperty &property);

// The reason, for the report, why an element is dropped as a whole.
std::string_view drop_reason(const PlyHeader &header, const PlyElement &element);

} // namespace pbm::build
