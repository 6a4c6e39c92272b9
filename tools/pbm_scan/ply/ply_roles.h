// The meaning of the elements and properties of a PLY file, with all accepted spellings.
#pragma once

#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/surface/surface.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace pbm::build {

// Properties by role: pointers into the header, null if absent; all or none of a group of three.
struct PlyRoles {
    using Three = std::array<const PlyProperty *, 3>;

    const PlyElement *vertex = nullptr; // always there
    Three position{}, normal{}, colour{}, face_colour{};
    const PlyProperty *radius = nullptr, *material_index = nullptr;
    std::array<const PlyProperty *, kByteAttributes.size()> bytes{};
    const PlyProperty *material_red = nullptr;                    // of element material
    std::array<const PlyProperty *, 2> place{};                   // u v of a vertex
    const PlyProperty *corner_places = nullptr, *image = nullptr; // of a face
    bool splat_colours = false; // coefficients of spherical harmonics: f_dc_0 f_dc_1 f_dc_2

    std::vector<const PlyProperty *> fields;   // numbers of a vertex that are kept
    const PlyProperty *only_classes = nullptr; // that of them which is for --drop-class alone

    std::size_t field_number(const PlyProperty &property) const { // of a property with that role
        return static_cast<std::size_t>(std::find(fields.begin(), fields.end(), &property) - fields.begin());
    }
    std::size_t byte_attribute(const PlyProperty &property) const { // of a property with that role
        return static_cast<std::size_t>(std::find(bytes.begin(), bytes.end(), &property) - bytes.begin());
    }
};

// Where the file names images: u v of a vertex, texcoord and texnumber of a face.
//
// Sets `kind` and `role` of all elements and properties: vertex (x y z; nx ny nz; red green blue; radius;
// material_index; kByteAttributes), face and tristrips (vertex_indices; red green blue of a face), range_grid
// (vertex_indices), and the dissertation's material (ka kd ks power clr_r clr_g clr_b envmapfactor). A group of three
// must be complete. The first spelling found in the order of ply_roles.cpp wins; f_dc_0 f_dc_1 f_dc_2 of a Gaussian
// splat are the last one of red green blue. Face colours are used only if vertices have none; a range grid only without
// faces, and if obj_info gives its width and height.
//
// errors  bad_input  no element vertex, no x y z in it, no vertices at all, or a coordinate that is a list
Result<PlyRoles> resolve_roles(PlyHeader &header);

// The numbers of vertices that could be fields. A radius or another number that has a role keeps it.
std::vector<PlyProperty *> free_numbers(PlyHeader &header);

// Why a property that has no role is dropped.
std::string_view drop_reason(const PlyElement &element, const PlyProperty &property);

// Why an element that is skipped is dropped.
std::string_view drop_reason(const PlyHeader &header, const PlyElement &element);

} // namespace pbm::build
