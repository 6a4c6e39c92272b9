// What the elements and properties of a PLY file mean to PBM: all the spellings that are understood, in one place.
#pragma once

#include "pbm_scan/ply_header.h"

#include <string>
#include <string_view>

namespace pbm::build {

// Sets `kind` and `role` throughout: vertex (x y z; nx ny nz; red green blue; radius; material_index), face and
// tristrips (vertex_indices; red green blue of a face), and the dissertation's material (ka kd ks power clr_r clr_g
// clr_b envmapfactor). A group of three counts only as a whole; of two spellings the first one here wins. Faces only
// keep their colours where vertices have none.
//
// errors  bad_input  no element vertex, no x y z in it, no vertices at all, or a coordinate that is a list
Status assign_roles(PlyHeader &header);

const PlyElement *find_element(const PlyHeader &header, PlyKind kind);
const PlyProperty *find_property(const PlyElement &element, PlyRole role); // null: no such property

// Why a property that has no role is dropped.
std::string_view drop_reason(const PlyElement &element, const PlyProperty &property);

// Why an element that is skipped is dropped.
std::string_view drop_reason(const PlyElement &element);

} // namespace pbm::build
