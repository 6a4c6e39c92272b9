#include "pbm_scan/ply/ply_roles.h"

#include "pbm_scan/clouds/gaussian_splats.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"

#include <initializer_list>

namespace pbm::build {
namespace {

using PlySpelling = std::array<std::string_view, 3>;

// The first of `all` with this name, else the first with it in other letter case ("X", "Red").
template <class Named, class Fits> Named *named(std::vector<Named> &all, std::string_view name, const Fits &fits) {
    Named *found = nullptr;
    for (Named &each : all) {
        if (each.name == name && fits(each))
            return &each;
        if (found == nullptr && same_word(each.name, name) && fits(each))
            found = &each;
    }
    return found;
}

PlyProperty *property_named(PlyElement &element, std::string_view name, bool is_list = false) {
    return named(element.properties, name, [&](const PlyProperty &each) { return each.is_list == is_list; });
}

PlyElement *element_named(PlyHeader &header, std::string_view name) {
    return named(header.elements, name, [](const PlyElement &) { return true; });
}

// Gives the first complete spelling the roles `first`, `first` + 1, `first` + 2.
PlyRoles::Three assign_triple(PlyElement &element, PlyRole first, std::initializer_list<PlySpelling> spellings) {
    for (const PlySpelling &names : spellings) {
        const std::array<PlyProperty *, 3> found{property_named(element, names[0]), property_named(element, names[1]),
                                                 property_named(element, names[2])};
        if (found[0] == nullptr || found[1] == nullptr || found[2] == nullptr)
            continue;
        for (std::size_t i = 0; i < 3; ++i)
            found[i]->role = static_cast<PlyRole>(static_cast<std::size_t>(first) + i);
        return {found[0], found[1], found[2]};
    }
    return {};
}

PlyRoles::Three assign_colours(PlyElement &element) {
    return assign_triple(element, PlyRole::red,
                         {{"red", "green", "blue"},
                          {"r", "g", "b"},
                          {"diffuse_red", "diffuse_green", "diffuse_blue"},
                          {"f_dc_0", "f_dc_1", "f_dc_2"}});
}

const PlyProperty *assign_one(PlyElement &element, PlyRole role, std::initializer_list<std::string_view> names,
                              bool is_list = false) {
    for (const std::string_view name : names)
        if (PlyProperty *property = property_named(element, name, is_list)) {
            property->role = role;
            return property;
        }
    return nullptr;
}

void assign_places(PlyElement &vertex, PlyRoles &roles) {
    constexpr std::array<std::array<std::string_view, 2>, 5> kSpellings{
        {{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}, {"s0", "t0"}}};
    for (const auto &names : kSpellings) {
        PlyProperty *const u = property_named(vertex, names[0]), *const v = property_named(vertex, names[1]);
        if (u == nullptr || v == nullptr)
            continue;
        u->role = PlyRole::u;
        v->role = PlyRole::v;
        roles.place = {u, v};
        return;
    }
}

// Sets `kind` of an element with a list of corners.
bool assign_corners(PlyElement &element, PlyKind kind) {
    if (assign_one(element, PlyRole::corners, {"vertex_indices", "vertex_index"}, true) == nullptr)
        return false;
    element.kind = kind;
    return true;
}

Status assign_vertex(PlyElement &vertex, PlyRoles &roles) {
    vertex.kind = PlyKind::vertex;
    roles.vertex = &vertex;
    for (const std::string_view name : {"x", "y", "z"})
        if (property_named(vertex, name) == nullptr)
            return bad_input(in_line(vertex) + "element vertex has no number " + printable_in_quotes(name) +
                                 ": a scan needs x, y and z for each vertex",
                             vertex.offset);
    if (vertex.count == 0)
        return bad_input(in_line(vertex) + "element vertex has no vertices: there is nothing to build", vertex.offset);
    roles.position = assign_triple(vertex, PlyRole::x, {{"x", "y", "z"}});
    roles.normal = assign_triple(vertex, PlyRole::nx, {{"nx", "ny", "nz"}, {"normal_x", "normal_y", "normal_z"}});
    roles.colour = assign_colours(vertex);
    roles.splat_colours = roles.colour[0] != nullptr && same_word(roles.colour[0]->name, "f_dc_0");
    roles.radius = assign_one(vertex, PlyRole::radius, {"radius"});
    roles.material_index = assign_one(vertex, PlyRole::material_index, {"material_index", "material"});
    for (std::size_t i = 0; i < kByteAttributes.size(); ++i)
        if (const PlyProperty *property = property_named(vertex, kByteAttributes[i].property);
            property != nullptr && property->type == PlyScalar::uint8)
            roles.bytes[i] = assign_one(vertex, PlyRole::byte, {kByteAttributes[i].property});
    return {};
}

void assign_material(PlyElement &material) {
    constexpr std::array<std::string_view, 10> kNames{"ka",    "kd",    "ks",           "power", "clr_r",
                                                      "clr_g", "clr_b", "envmapfactor", "shape", "tint"};
    for (std::size_t i = 0; i < kNames.size(); ++i)
        if (assign_one(material, static_cast<PlyRole>(static_cast<std::size_t>(PlyRole::ka) + i), {kNames[i]}))
            material.kind = PlyKind::material;
}

bool starts_with_any(std::string_view name, std::initializer_list<std::string_view> beginnings) {
    return std::any_of(beginnings.begin(), beginnings.end(),
                       [&](std::string_view beginning) { return name.starts_with(beginning); });
}

bool is_any(std::string_view name, std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

bool has_faces(const PlyHeader &header) {
    return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement &element) {
        return (element.kind == PlyKind::face || element.kind == PlyKind::tristrips) && element.count != 0;
    });
}

bool grid_size_fits(const PlyHeader &header, const PlyElement &grid) {
    return header.grid_columns != 0 && grid.count % header.grid_columns == 0 &&
           grid.count / header.grid_columns == header.grid_rows;
}

} // namespace

Result<PlyRoles> resolve_roles(PlyHeader &header) {
    PlyRoles roles;
    PlyElement *vertex = element_named(header, "vertex");
    if (vertex == nullptr)
        return bad_input("the file has no element 'vertex': it is not a scan");
    if (Status status = assign_vertex(*vertex, roles); !status)
        return std::move(status).error();
    const bool has_images = !header.texture_files.empty();
    if (has_images)
        assign_places(*vertex, roles);
    PlyElement *const face = element_named(header, "face");
    if (face != nullptr && assign_corners(*face, PlyKind::face)) {
        if (roles.colour[0] == nullptr)
            roles.face_colour = assign_colours(*face);
        if (has_images) {
            roles.corner_places = assign_one(*face, PlyRole::corner_places, {"texcoord"}, true);
            roles.image = assign_one(*face, PlyRole::image, {"texnumber"});
        }
    }
    if (PlyElement *strips = element_named(header, "tristrips"))
        assign_corners(*strips, PlyKind::tristrips);
    if (PlyElement *grid = element_named(header, "range_grid"))
        if (!has_faces(header) && grid_size_fits(header, *grid))
            assign_corners(*grid, PlyKind::range_grid);
    if (PlyElement *material = element_named(header, "material")) {
        assign_material(*material);
        roles.material_red = property_named(*material, "clr_r");
    }
    return roles;
}

void assign_splats(PlyHeader &header, PlyRoles &roles) {
    constexpr std::array<std::string_view, 8> kNames{"scale_0", "scale_1", "scale_2", "rot_0",
                                                     "rot_1",   "rot_2",   "rot_3",   "opacity"};
    const auto may_be_absent = [](std::string_view name) { return name == "scale_2" || name == "opacity"; };
    if (!roles.splat_colours)
        return;
    std::array<PlyProperty *, kNames.size()> found{};
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        found[i] = property_named(*element_named(header, "vertex"), kNames[i]);
        if (found[i] == nullptr && !may_be_absent(kNames[i]))
            return;
    }
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        roles.splat[i] = found[i];
        if (found[i] != nullptr && found[i]->role == PlyRole::none)
            found[i]->role = PlyRole::splat;
    }
}

std::vector<PlyProperty *> free_numbers(PlyHeader &header) {
    std::vector<PlyProperty *> numbers;
    for (PlyProperty &property : element_named(header, "vertex")->properties)
        if (property.role == PlyRole::none && !property.is_list)
            numbers.push_back(&property);
    return numbers;
}

std::string_view drop_reason(const PlyElement &element, const PlyProperty &property) {
    const std::string name = lower_case(property.name);
    if (property.is_list && element.kind == PlyKind::vertex)
        return "a list; a point has single numbers";
    if (is_any(name, {"alpha", "a", "diffuse_alpha", "opacity"}))
        return "PBM's points are opaque";
    if (is_any(name, {"s", "t", "u", "v", "texcoord", "texnumber", "texture_u", "texture_v", "texture_s", "texture_t",
                      "s0", "t0"}))
        return "texture coordinates; no image belongs to them";
    if (is_any(name, {"nx", "ny", "nz", "normal_x", "normal_y", "normal_z"}))
        return element.kind == PlyKind::vertex ? "a normal needs three numbers"
                                               : "normals of faces follow from the points";
    if (is_any(name, {"red", "green", "blue", "r", "g", "b", "diffuse_red", "diffuse_green", "diffuse_blue"}))
        return element.kind == PlyKind::vertex ? "a colour needs red, green and blue, and only the first one counts"
                                               : "the vertices have colours of their own";
    if (starts_with_any(name, {"f_dc_", "f_rest_"}))
        return kSplatHarmonicsNote;
    if (starts_with_any(name, {"scale_", "rot_"}))
        return "the shape of a Gaussian splat needs scale_0 scale_1 rot_0 rot_1 rot_2 rot_3";
    if (is_any(name, {"confidence", "quality", "intensity", "value", "curvature"}) ||
        starts_with_any(name, {"scalar_"}))
        return "a measurement that is not shown";
    return "not used by PBM";
}

std::string_view drop_reason(const PlyHeader &header, const PlyElement &element) {
    if (element.name == "range_grid" && has_faces(header))
        return "the file has faces of its own";
    if (element.name == "range_grid" && !grid_size_fits(header, element))
        return "obj_info num_cols and num_rows do not say how wide and high it is; the vertices are kept as points";
    if (element.name == "range_grid" || element.name == "face" || element.name == "tristrips")
        return "it has no list vertex_indices; the vertices are kept as points";
    if (element.name == "edge")
        return "PBM shows no lines";
    if (element.name == "camera")
        return "PBM's cameras are chosen when a model is shown";
    if (element.name == "material")
        return "it has none of ka, kd, ks, power, clr_r, clr_g, clr_b, envmapfactor, shape, tint";
    return "not used by PBM";
}

} // namespace pbm::build
