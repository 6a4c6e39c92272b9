// What the elements and properties of a PLY file mean to PBM: all the spellings that are understood, in one place.
#pragma once

#include "pbm_scan/ply/ply_header.h"

#include <string>
#include <string_view>

namespace pbm::build {

// Sets `kind` and `role` throughout: vertex (x y z; nx ny nz; red green blue; radius; material_index; two_sided), face
// and tristrips (vertex_indices; red green blue of a face), range_grid (vertex_indices), and the dissertation's
// material (ka kd ks power clr_r clr_g clr_b envmapfactor). A group of three counts only as a whole; of two spellings
// the first one here wins; a Gaussian splat's f_dc_0 f_dc_1 f_dc_2 are the last spelling of red green blue. Faces only
// keep their colours where vertices have none. A range grid counts only where there are no faces and obj_info gives its
// width and height.
//
// errors  bad_input  no element vertex, no x y z in it, no vertices at all, or a coordinate that is a list
Status assign_roles(PlyHeader &header);

const PlyElement *find_element(const PlyHeader &header, PlyKind kind);
const PlyProperty *find_property(const PlyElement &element, PlyRole role); // null: no such property

// Why a property that has no role is dropped.
std::string_view drop_reason(const PlyElement &element, const PlyProperty &property);

// Why an element that is skipped is dropped.
std::string_view drop_reason(const PlyHeader &header, const PlyElement &element);

// Colours are coefficients of spherical harmonics (f_dc_0 f_dc_1 f_dc_2).
bool has_splat_colours(const PlyElement &element);

} // namespace pbm::build
