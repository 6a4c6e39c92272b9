#include "pbm_build/surface/merge_surfaces.h"

#include "pbm_build/surface/creases.h"
#include "pbm_build/surface/vertex_normals.h"
#include "pbm_format/model/streams.h"
#include "pbm_scan/surface/refusal.h"
#include "system/free_memory.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace pbm::build {
namespace {

auto key(const Material &m) { return std::tie(m.ka, m.kd, m.ks, m.power, m.colour, m.environment, m.tint); }

// The attributes of the merged surface: an array has one entry here if it is not empty in at least one of `surfaces`.
Surface attributes_of(const std::vector<Surface> &surfaces) {
    Surface has;
    const auto note = [](auto &to, const auto &values) {
        if (!values.empty())
            to.resize(1);
    };
    for (const Surface &surface : surfaces) {
        for_vertex_attributes(note, has, surface);
        note(has.materials, surface.materials);
    }
    has.material_ids.resize(1); // `adapt` gives them to all
    return has;
}

std::vector<Material> materials_of(const Surface &surface) {
    return surface.materials.empty() ? std::vector<Material>(1) : surface.materials;
}

std::vector<Material> all_materials(const std::vector<Surface> &surfaces) {
    std::vector<Material> all;
    for (const Surface &surface : surfaces)
        for (const Material &material : materials_of(surface))
            all.push_back(material);
    std::sort(all.begin(), all.end(), [](const Material &a, const Material &b) { return key(a) < key(b); });
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

// Those of `materials`, from the first surface that has each.
std::vector<std::optional<Reflectance>> all_reflectances(const std::vector<Surface> &surfaces,
                                                         const std::vector<Material> &materials) {
    std::vector<std::optional<Reflectance>> all(materials.size());
    for (std::size_t k = 0; k < all.size(); ++k)
        for (const Surface &surface : surfaces)
            for (std::size_t i = 0; i < surface.reflectances.size() && !all[k]; ++i)
                if (surface.materials[i] == materials[k])
                    all[k] = surface.reflectances[i];
    return all;
}

// Gives `surface` the arrays of `has`, and numbers its materials as in `materials`.
void adapt(Surface &surface, const Surface &has, const std::vector<Material> &materials) {
    const std::size_t count = surface.positions.size();
    const std::vector<Material> own = materials_of(surface);
    if (surface.material_ids.empty())
        surface.material_ids.assign(count, 0);
    if (!has.colours.empty() && surface.colours.empty()) {
        surface.colours.reserve(count);
        for (const std::uint8_t id : surface.material_ids)
            surface.colours.push_back(own[id].colour);
        if (surface.face_colours.empty())
            surface.report.push_back({"colours", Fate::converted, "it has none: those of its materials", surface.name});
    }
    if (!has.materials.empty() && surface.materials.empty())
        surface.report.push_back({"materials", Fate::converted, "it has none: the default one", surface.name});
    std::vector<std::uint8_t> new_id;
    new_id.reserve(own.size());
    for (const Material &material : own)
        new_id.push_back(
            static_cast<std::uint8_t>(std::find(materials.begin(), materials.end(), material) - materials.begin()));
    for (std::uint8_t &id : surface.material_ids)
        id = new_id[id];
    if (!has.station_ids.empty() && surface.station_ids.empty())
        surface.station_ids.assign(count, kNoStation);
    for_vertex_attributes([&](auto &values, const auto &any) { values.resize(any.empty() ? 0 : count, {}); }, surface,
                          has);
}

// Numbers the stations of all surfaces in `merged`. Where they are more than a number of 16 bits counts, there are
// none.
void unite_stations(std::vector<Surface> &surfaces, Surface &merged) {
    std::size_t count = 0;
    for (const Surface &surface : surfaces)
        count += surface.stations.size();
    for (Surface &surface : surfaces) {
        if (count > kNoStation) {
            if (!surface.stations.empty())
                surface.report.push_back({"scanner positions", Fate::dropped,
                                          std::to_string(count) + " in all, the limit is 65535", surface.name});
            free_memory(surface.station_ids);
            continue;
        }
        const auto first = static_cast<std::uint16_t>(merged.stations.size());
        for (std::uint16_t &id : surface.station_ids)
            if (id != kNoStation)
                id = static_cast<std::uint16_t>(id + first);
        merged.stations.insert(merged.stations.end(), surface.stations.begin(), surface.stations.end());
    }
}

template <class T> void append(std::vector<T> &to, std::vector<T> &from) {
    to.insert(to.end(), from.begin(), from.end());
    free_memory(from);
}

void append(Surface &to, Surface &from) {
    const auto first = static_cast<std::uint32_t>(to.positions.size());
    const auto first_texture = static_cast<std::uint16_t>(to.textures.size());
    const auto renumber = [first_texture](std::vector<std::uint16_t> &ids) {
        for (std::uint16_t &texture : ids)
            texture = texture == Surface::kNoTexture ? texture : static_cast<std::uint16_t>(texture + first_texture);
    };
    renumber(from.texture_ids);
    for (ImageLayer &layer : from.layers)
        renumber(layer.ids);
    const auto append_attribute = [&](auto &all, auto &part) {
        if (all.empty() && part.empty())
            return;
        resize_for_triangles(all, to.triangles.size());
        resize_for_triangles(part, from.triangles.size());
        append(all, part);
    };
    for_triangle_attributes(append_attribute, to, from);
    std::move(from.textures.begin(), from.textures.end(), std::back_inserter(to.textures));
    from.textures.clear();
    for (const glm::uvec3 &t : from.triangles)
        to.triangles.push_back(t + first);
    free_memory(from.triangles);
    append(to.positions, from.positions);
    for_vertex_attributes([](auto &all, auto &part) { append(all, part); }, to, from);
}

// Makes the points beside triangles surfaces of their own.
void separate_points(std::vector<Surface> &surfaces) {
    for (std::size_t i = 0, count = surfaces.size(); i < count; ++i) {
        const std::size_t first = surfaces[i].first_point();
        if (surfaces[i].triangles.empty() || first == surfaces[i].positions.size())
            continue;
        const auto move = [first](auto &from, auto &to) {
            if (from.empty())
                return;
            to.assign(from.begin() + static_cast<std::ptrdiff_t>(first), from.end());
            from.resize(first);
        };
        Surface points;
        move(surfaces[i].positions, points.positions);
        for_vertex_attributes(move, surfaces[i], points);
        surfaces[i].points_beside_triangles = 0;
        surfaces.push_back(std::move(points));
    }
}

// Reserved memory becomes resident only when it is filled, while `append` frees the parts.
void reserve(Surface &surface, std::size_t vertices, std::size_t triangles, const Surface &has) {
    surface.triangles.reserve(triangles);
    surface.positions.reserve(vertices);
    for_vertex_attributes([&](auto &values, const auto &any) { values.reserve(any.empty() ? 0 : vertices); }, surface,
                          has);
}

// Returns the crease angle of all. Where only some surfaces have flat facets, these get normals.
std::optional<double> unite_creases(std::vector<Surface> &surfaces) {
    const auto is_flat = [](const Surface &surface) { return surface.crease_angle == 0.0; };
    const auto other = std::find_if(surfaces.begin(), surfaces.end(), [&](const Surface &surface) {
        return !surface.triangles.empty() && !is_flat(surface);
    });
    if (other == surfaces.end())
        return 0.0;
    for (Surface &surface : surfaces)
        if (is_flat(surface))
            separate_facets(surface);
    return other->crease_angle;
}

} // namespace

Result<Surface> merge_surfaces(std::vector<Surface> surfaces, int threads) {
    if (surfaces.size() == 1)
        return std::move(surfaces.front());
    const std::optional<double> crease_angle = unite_creases(surfaces);
    std::size_t vertices = 0, triangles = 0;
    std::size_t textures = 0;
    for (const Surface &surface : surfaces) {
        vertices += surface.positions.size();
        triangles += surface.triangles.size();
        textures += surface.textures.size();
    }
    if (textures > Surface::kNoTexture)
        return too_large(std::to_string(textures) + " images in all, the limit is 2^16 - 1: merge fewer scans");
    if (vertices >= std::numeric_limits<std::uint32_t>::max())
        return too_large(std::to_string(vertices) + " vertices in all, the limit is 2^32 - 2: merge fewer scans");
    Surface merged;
    const bool share_crs = std::all_of(surfaces.begin(), surfaces.end(),
                                       [&](const Surface &surface) { return surface.crs == surfaces.front().crs; });
    merged.crs = share_crs ? surfaces.front().crs : "";
    unite_stations(surfaces, merged);
    merged.closed =
        std::all_of(surfaces.begin(), surfaces.end(), [](const Surface &surface) { return surface.closed; });
    const Surface has = attributes_of(surfaces);
    merged.crease_angle = crease_angle;
    merged.materials = all_materials(surfaces);
    if (merged.materials.size() > kMaxMaterials)
        return unsupported(std::to_string(merged.materials.size()) +
                           " different materials in all, a .pbvg file holds " + std::to_string(kMaxMaterials) +
                           "; merge some of them");
    merged.reflectances = all_reflectances(surfaces, merged.materials);
    reserve(merged, vertices, triangles, has);
    for (Surface &surface : surfaces) {
        adapt(surface, has, merged.materials);
        merged.report.insert(merged.report.end(), surface.report.begin(), surface.report.end());
        merged.offered_fields.insert(merged.offered_fields.end(), surface.offered_fields.begin(),
                                     surface.offered_fields.end());
        merged.views.insert(merged.views.end(), surface.views.begin(), surface.views.end());
        merged.part_names.insert(merged.part_names.end(), surface.part_names.begin(), surface.part_names.end());
        for (std::size_t slot = 0; slot < kFieldSlots; ++slot)
            if (!merged.field_units[slot])
                merged.field_units[slot] = surface.field_units[slot];
    }
    separate_points(surfaces);
    for (Surface &surface : surfaces) {
        if (surface.triangles.empty())
            continue;
        if (faces_point_inward(surface, threads))
            reverse_faces(surface);
        append(merged, surface);
    }
    if (!merged.triangles.empty())
        merged.points_beside_triangles = vertices - merged.positions.size();
    for (Surface &surface : surfaces)
        append(merged, surface); // the points
    if (has.materials.empty())
        merged.materials.clear();
    if (merged.materials.size() <= 1)
        free_memory(merged.material_ids);
    return merged;
}

} // namespace pbm::build
