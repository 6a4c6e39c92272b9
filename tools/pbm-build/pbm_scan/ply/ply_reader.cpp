#include "pbm_scan/ply/ply_reader.h"

#include "pbm_scan/ply/ply_body.h"
#include "pbm_scan/ply/ply_colours.h"
#include "pbm_scan/ply/ply_damage.h"
#include "pbm_scan/surface/range_grid.h"
#include "pbm_scan/text/text_lines.h"

#include <cmath>
#include <optional>

namespace pbm::build {
namespace {

struct Outcomes {
    PlyOutcome normals, colours, face_colours, radii, material_ids, grid;
    PlyOutcome positions{.note = "positions"}, materials{.note = "material"}, faces{.note = "polygons as triangles"};
    PlyOutcome strips{Fate::converted, "strips to triangles"};
    std::array<PlyOutcome, kByteAttributes.size()> bytes;
};

PlyOutcome finish_normals(PlyBody &body, Surface &surface) {
    std::size_t absent = 0;
    for (glm::vec3 &n : body.normals) {
        if (!std::isfinite(n.x) || !std::isfinite(n.y) || !std::isfinite(n.z))
            n = glm::vec3(0.0F);
        absent += n == glm::vec3(0.0F) ? 1U : 0U;
    }
    if (absent == body.normals.size())
        return {Fate::converted, "all are zero: estimated anew"};
    surface.normals = std::move(body.normals);
    return {Fate::kept,
            absent == 0 ? "normals" : std::to_string(absent) + " have no length: taken from their neighbours"};
}

PlyOutcome finish_radii(PlyBody &body, Surface &surface) {
    std::size_t bad = 0;
    for (const float radius : body.radii)
        bad += radius > 0.0F && std::isfinite(radius) ? 0U : 1U;
    if (bad != 0)
        return {Fate::dropped, std::to_string(bad) + " are not positive: radii are chosen anew"};
    surface.radii = std::move(body.radii);
    return {Fate::kept, "splat radius"};
}

Result<Material> finish_material(const std::array<double, 8> &values, std::size_t row, double colour_scale,
                                 Material material) {
    const auto refuse = [row](const char *name, const char *range) {
        return bad_input("material " + std::to_string(row) + ": " + name + " must be in " + range);
    };
    const std::array<std::pair<float *, const char *>, 4> factors{
        {{&material.ka, "ka"}, {&material.kd, "kd"}, {&material.ks, "ks"}, {&material.power, "power"}}};
    constexpr double kMost = 1e6;
    for (std::size_t i = 0; i < factors.size(); ++i) {
        if (std::isnan(values[i]))
            continue; // not in the file
        if (!(values[i] >= 0 && values[i] <= kMost))
            return refuse(factors[i].second, "0..1000000");
        *factors[i].first = static_cast<float>(values[i]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const double value = values[4 + i] * colour_scale;
        if (std::isnan(value))
            continue;
        if (!(value >= 0 && value <= 255))
            return refuse("the colour", "0..255 or 0..1");
        material.colour[i] = static_cast<std::uint8_t>(value + 0.5);
    }
    if (!std::isnan(values[7])) {
        if (!(values[7] >= 0 && values[7] <= 1))
            return refuse("envmapfactor", "0..1");
        material.environment = static_cast<float>(values[7]);
    }
    return material;
}

// Colours are 0..255 if one of them is above 1 or their type is integer, else 0..1.
double material_colour_scale(const PlyProperty *red, const PlyBody &body) {
    bool unit = red == nullptr || is_float(red->type);
    for (const std::array<double, 8> &values : body.materials)
        for (std::size_t i = 4; i < 7; ++i)
            unit = unit && !(values[i] > 1.0);
    return unit ? 255.0 : 1.0;
}

Result<PlyOutcome> finish_material_ids(const PlyBody &body, Surface &surface) {
    if (surface.materials.empty())
        return PlyOutcome{Fate::dropped, "the file has no element material with ka, kd, ks..."};
    surface.material_ids.reserve(body.material_ids.size());
    for (std::size_t i = 0; i < body.material_ids.size(); ++i) {
        const float id = body.material_ids[i];
        if (!(id >= 0 && id < static_cast<float>(surface.materials.size()) && id == std::floor(id)))
            return bad_input("vertex " + std::to_string(i) + " has material " + number_text(static_cast<double>(id)) +
                             ", but there are " + std::to_string(surface.materials.size()) + "; export the scan again");
        surface.material_ids.push_back(static_cast<std::uint8_t>(id));
    }
    return PlyOutcome{Fate::kept, "material"};
}

PlyOutcome finish_range_grid(const PlyHeader &header, const PlyBody &body, Surface &surface) {
    std::vector<glm::uvec3> triangles =
        triangulate_range_grid(body.grid_cells, static_cast<std::size_t>(header.grid_columns), surface.positions);
    if (triangles.empty())
        return {Fate::dropped, "no three neighbours in it; the vertices are kept as points"};
    surface.triangles = std::move(triangles);
    return {Fate::converted, "a range image of " + std::to_string(header.grid_columns) + " x " +
                                 std::to_string(header.grid_rows) +
                                 " to triangles; steps in depth of more than 4 grid steps stay open"};
}

Result<Outcomes> finish(const PlyHeader &header, const PlyRoles &roles, PlyBody &body, const Material &default_material,
                        Surface &surface) {
    Outcomes outcomes;
    surface.positions = std::move(body.positions);
    surface.triangles = std::move(body.triangles);
    surface.dropped_triangles = body.degenerate_triangles;
    if (roles.normal[0] != nullptr)
        outcomes.normals = finish_normals(body, surface);
    if (roles.colour[0] != nullptr)
        outcomes.colours = finish_colours(roles, body, surface);
    if (!body.face_colours.empty())
        outcomes.face_colours = finish_face_colours(roles, body, surface);
    if (!body.radii.empty())
        outcomes.radii = finish_radii(body, surface);
    const double scale = material_colour_scale(roles.material_red, body);
    for (const std::array<double, 8> &values : body.materials) {
        Result<Material> finished = finish_material(values, surface.materials.size(), scale, default_material);
        if (!finished)
            return finished.error();
        surface.materials.push_back(*finished);
    }
    if (!body.material_ids.empty()) {
        Result<PlyOutcome> ids = finish_material_ids(body, surface);
        if (!ids)
            return ids.error();
        outcomes.material_ids = *ids;
    }
    for (std::size_t i = 0; i < kByteAttributes.size(); ++i) {
        surface.*kByteAttributes[i].values = std::move(body.bytes[i]);
        outcomes.bytes[i].note = kByteAttributes[i].note;
    }
    if (!body.grid_cells.empty())
        outcomes.grid = finish_range_grid(header, body, surface);
    return outcomes;
}

const PlyOutcome *outcome_of(const PlyElement &element, const PlyProperty &property, const PlyRoles &roles,
                             const Outcomes &outcomes) {
    const PlyRole role = property.role;
    const PlyKind kind = element.kind;
    return role == PlyRole::none             ? nullptr
           : role <= PlyRole::z              ? &outcomes.positions
           : role <= PlyRole::nz             ? &outcomes.normals
           : role <= PlyRole::blue           ? kind == PlyKind::vertex ? &outcomes.colours : &outcomes.face_colours
           : role == PlyRole::radius         ? &outcomes.radii
           : role == PlyRole::material_index ? &outcomes.material_ids
           : role == PlyRole::byte           ? &outcomes.bytes[roles.byte_attribute(property)]
           : role != PlyRole::corners        ? &outcomes.materials
           : kind == PlyKind::face           ? &outcomes.faces
           : kind == PlyKind::tristrips      ? &outcomes.strips
                                             : &outcomes.grid;
}

// One report line per group of consecutive properties with the same outcome or the same reason for their drop.
void report_element(const PlyElement &element, const PlyRoles &roles, const Outcomes &outcomes,
                    std::vector<AttributeReport> &report) {
    constexpr std::size_t kMaxNames = 4; // a larger group is written as its first and last name
    for (std::size_t i = 0; i < element.properties.size();) {
        const PlyProperty &first = element.properties[i];
        const PlyOutcome *outcome = outcome_of(element, first, roles, outcomes);
        const auto belongs = [&](const PlyProperty &next) {
            return outcome_of(element, next, roles, outcomes) == outcome &&
                   (outcome != nullptr || drop_reason(element, next) == drop_reason(element, first));
        };
        std::size_t end = i + 1;
        while (end < element.properties.size() && belongs(element.properties[end]))
            ++end;
        std::string name = printable(element.name + "." + first.name);
        if (end - i > kMaxNames)
            name.append("..").append(printable(element.properties[end - 1].name));
        else
            for (std::size_t k = i + 1; k < end; ++k)
                name.append(1, ' ').append(printable(element.properties[k].name));
        report.push_back(outcome != nullptr
                             ? AttributeReport{name, outcome->fate, outcome->note}
                             : AttributeReport{name, Fate::dropped, std::string(drop_reason(element, first))});
        i = end;
    }
}

void write_report(const PlyHeader &header, const PlyRoles &roles, const Outcomes &outcomes, Surface &surface) {
    if (header.unknown_lines != 0)
        surface.report.push_back({"header", Fate::dropped,
                                  std::to_string(header.unknown_lines) +
                                      " lines of no meaning, the first begins with " +
                                      printable_in_quotes(header.first_unknown)});
    for (const std::string &file : header.texture_files)
        surface.report.push_back(
            {"texture image " + printable_in_quotes(file), Fate::dropped, "PBM stores point colours"});
    if (header.further_textures != 0)
        surface.report.push_back({std::to_string(header.further_textures) + " further texture images", Fate::dropped,
                                  "PBM stores point colours"});
    for (const PlyElement &element : header.elements) {
        if (element.kind != PlyKind::skipped)
            report_element(element, roles, outcomes, surface.report);
        else if (element.count != 0 && !element.properties.empty()) {
            const std::string name = printable_in_quotes(element.name);
            surface.report.push_back({"element " + name, Fate::dropped, std::string(drop_reason(header, element))});
        }
    }
}

// The number of bytes after the last row, without white space.
std::size_t trailing_bytes(std::span<const std::uint8_t> bytes, const PlyHeader &header, std::size_t at) {
    std::size_t word = at;
    while (word < bytes.size() && ends_word(static_cast<char>(bytes[word])))
        ++word;
    return word == bytes.size() || header.encoding == PlyEncoding::ascii ? bytes.size() - word : bytes.size() - at;
}

} // namespace

Result<Surface> read_ply(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    Result<PlyHeader> header = read_ply_header(bytes);
    if (!header)
        return header.error();
    const Result<PlyRoles> roles = resolve_roles(*header);
    if (!roles)
        return roles.error();
    if (const std::optional<Error> text = text_in_binary_body(bytes, *header))
        return *text;
    Result<PlyBody> body = read_ply_body(bytes, *header, *roles, options);
    const std::size_t inserted = inserted_line_ends(bytes, *header);
    if (!body) {
        if (inserted != 0)
            return inserted_line_ends_error(*header);
        body.error().message += body_hint(bytes, *header, static_cast<std::size_t>(body.error().offset));
        return body.error();
    }
    const std::size_t trailing = trailing_bytes(bytes, *header, body->end_offset);
    if (inserted != 0 && trailing != 0 && trailing <= inserted)
        return inserted_line_ends_error(*header);

    Surface surface;
    const Result<Outcomes> outcomes = finish(*header, *roles, *body, options.default_material, surface);
    if (!outcomes)
        return outcomes.error();
    write_report(*header, *roles, *outcomes, surface);
    if (trailing != 0)
        surface.report.push_back({"end of file", Fate::dropped,
                                  std::to_string(trailing) + " bytes after the last element, at byte " +
                                      std::to_string(bytes.size() - trailing)});
    else if (header->encoding == PlyEncoding::ascii && !ends_word(static_cast<char>(bytes.back())))
        report_open_end(surface.report);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
