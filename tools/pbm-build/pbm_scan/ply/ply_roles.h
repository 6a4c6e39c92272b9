// What the elements and properties of a PLY file mean to PBM: all the spellings that are understood, in one place.
#pragma once

#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/surface/surface.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace pbm::build {

// The properties that mean something, by what they mean. Pointers into the header, null where it has none; a group of
// three has all or none.
struct PlyRoles {
    using Three = std::array<const PlyProperty *, 3>;

    const PlyElement *vertex = nullptr; // always there
    Three position{}, normal{}, colour{}, face_colour{};
    const PlyProperty *radius = nullptr, *material_index = nullptr;
    std::array<const PlyProperty *, kByteAttributes.size()> bytes{};
    const PlyProperty *material_red = nullptr; // of element material
    bool splat_colours = false;                // coefficients of spherical harmonics: f_dc_0 f_dc_1 f_dc_2

    std::size_t byte_attribute(const PlyProperty &property) const { // of a property with that role
        return static_cast<std::size_t>(std::find(bytes.begin(), bytes.end(), &property) - bytes.begin());
    }
};

// Sets `kind` and `role` throughout and resolves them: vertex (x y z; nx ny nz; red green blue; radius; material_index;
// kByteAttributes), face and tristrips (vertex_indices; red green blue of a face), range_grid (vertex_indices), and the
// dissertation's material (ka kd ks power clr_r clr_g clr_b envmapfactor). A group of three counts only as a whole; of
// two spellings the first one here wins; a Gaussian splat's f_dc_0 f_dc_1 f_dc_2 are the last spelling of red green
// blue. Faces only keep their colours where vertices have none. A range grid counts only where there are no faces and
// obj_info gives its width and height.
//
// errors  bad_input  no element vertex, no x y z in it, no vertices at all, or a coordinate that is a list
Result<PlyRoles> resolve_roles(PlyHeader &header);

// Why a property that has no role is dropped.
std::string_view drop_reason(const PlyElement &element, const PlyProperty &property);

// Why an element that is skipped is dropped.
std::string_view drop_reason(const PlyHeader &header, const PlyElement &element);

} // namespace pbm::build
