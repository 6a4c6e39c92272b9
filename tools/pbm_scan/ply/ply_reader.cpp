#include "pbm_scan/ply/ply_reader.h"

#include "pbm_scan/clouds/gaussian_splats.h"
#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/images/files_beside.h"
#include "pbm_scan/images/texture_images.h"
#include "pbm_scan/ply/packed_splats.h"
#include "pbm_scan/ply/ply_body.h"
#include "pbm_scan/ply/ply_colours.h"
#include "pbm_scan/ply/ply_damage.h"
#include "pbm_scan/surface/range_grid.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"

#include <cmath>
#include <filesystem>
#include <optional>

namespace pbm::build {
namespace {

struct Outcomes {
    PlyOutcome normals, colours, face_colours, radii, material_ids, grid;
    PlyOutcome positions{.note = "positions"}, materials{.note = "material"}, faces{.note = "polygons as triangles"};
    PlyOutcome images{Fate::converted, "colours of points"};
    PlyOutcome splats{Fate::converted, kSplatShapeNote};
    PlyOutcome fields, classes;
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

// The shapes of Gaussian splats: the file has logarithms of scales, w x y z of rotations, logits of opacities.
GaussianSplats splats_of(const PlyRoles &roles, const PlyBody &body) {
    const std::size_t count = body.positions.size();
    const auto value = [&](std::size_t i, std::size_t row) {
        return !body.splat[i].empty() ? body.splat[i][row]
                                      : static_cast<float>(body.fields[roles.field_number(*roles.splat[i])][row]);
    };
    constexpr std::size_t kThickness = 2, kRotation = 3, kOpacity = 7;
    GaussianSplats splats;
    splats.scales.reserve(count);
    splats.rotations.reserve(count);
    for (std::size_t row = 0; row < count; ++row) {
        const float thickness = roles.splat[kThickness] != nullptr ? exponential(value(kThickness, row)) : 0;
        splats.scales.emplace_back(exponential(value(0, row)), exponential(value(1, row)), thickness);
        splats.rotations.emplace_back(value(kRotation, row), value(kRotation + 1, row), value(kRotation + 2, row),
                                      value(kRotation + 3, row));
        if (roles.splat[kOpacity] != nullptr)
            splats.opacities.push_back(1 / (1 + exponential(-value(kOpacity, row))));
    }
    return splats;
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

Result<Material> finish_material(const std::array<double, 10> &values, std::size_t row, double colour_scale,
                                 Material material) {
    const auto refuse = [row](const char *name, const char *range) {
        return bad_input("material " + std::to_string(row) + ": " + name + " must be in " + range);
    };
    const std::array<std::pair<float *, const char *>, 4> factors{
        {{&material.ka, "ka"}, {&material.kd, "kd"}, {&material.ks, "ks"}, {&material.power, "power"}}};
    constexpr double kMax = 1e6;
    for (std::size_t i = 0; i < factors.size(); ++i) {
        if (std::isnan(values[i]))
            continue; // not in the file
        if (!(values[i] >= 0 && values[i] <= kMax))
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
    material.shape = values[8] == 1 ? PointShape::round : PointShape::disc;
    if (!std::isnan(values[9])) {
        if (!(values[9] >= 0 && values[9] <= 255))
            return refuse("tint", "0..255");
        material.tint = static_cast<std::uint8_t>(values[9] + 0.5);
    }
    return material;
}

// Colours are 0..255 if one of them is above 1 or their type is integer, else 0..1.
double material_colour_scale(const PlyProperty *red, const PlyBody &body) {
    bool unit = red == nullptr || is_float(red->type);
    for (const std::array<double, 10> &values : body.materials)
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

// "<this>" is MeshLab's word for the name of the file.
std::string image_name(const ScanFile &file, std::string name) {
    constexpr std::string_view kThis = "<this>";
    const std::size_t at = name.find(kThis);
    return at == std::string::npos ? name
                                   : name.replace(at, kThis.size(), std::filesystem::path(file.path).stem().string());
}

// Each image, in their order.
std::vector<NamedFile> image_files(const ScanFile &file, const PlyHeader &header) {
    std::vector<NamedFile> files;
    for (const std::string &name : header.texture_files)
        files.push_back(file.path.empty() ? NamedFile{} : name_beside(file.path, image_name(file, name)));
    return files;
}

// Colours triangles by the images, and reports each image.
PlyOutcome finish_images(const ScanFile &file, const PlyHeader &header, const PlyBody &body, Surface &surface) {
    // Faces before the vertices were cut into triangles late, in another order.
    const bool in_order = (body.corner_places.empty() || body.corner_places.size() == surface.triangles.size()) &&
                          (body.images.empty() || body.images.size() == surface.triangles.size());
    std::vector<AttributeReport> report;
    if (!in_order || (body.corner_places.empty() && body.places.empty())) {
        for (const std::string &name : header.texture_files)
            surface.report.push_back(
                {"texture image " + printable_in_quotes(name), Fate::dropped, "nothing names a place in it"});
        return {Fate::dropped, "faces stand before the vertices"};
    }
    const std::vector<NamedFile> files = image_files(file, header);
    TextureImages images(surface, report);
    std::vector<std::uint16_t> numbers;
    for (std::size_t i = 0; i < files.size(); ++i) {
        if (files[i].file.empty())
            report.push_back(line_of(Warning::missing_image,
                                     "texture image " + printable_in_quotes(header.texture_files[i]),
                                     why_missing(header.texture_files[i])));
        numbers.push_back(files[i].file.empty() ? Surface::kNoTexture : images.of_file(files[i].file, {}));
    }
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        const std::int32_t image = body.images.empty() ? 0 : body.images[i];
        const bool is_there = image >= 0 && static_cast<std::size_t>(image) < numbers.size();
        const glm::uvec3 &t = surface.triangles[i];
        TextureCorners corners = body.corner_places.empty()
                                     ? TextureCorners{body.places[t.x], body.places[t.y], body.places[t.z]}
                                     : body.corner_places[i];
        for (glm::vec2 &corner : corners)
            corner.y = 1 - corner.y; // the file counts upwards
        set_texture(surface, i, is_there ? numbers[static_cast<std::size_t>(image)] : Surface::kNoTexture, corners);
    }
    surface.report.insert(surface.report.end(), report.begin(), report.end());
    return surface.texture_ids.empty() ? PlyOutcome{Fate::dropped, "no image can be read"}
                                       : PlyOutcome{Fate::converted, "colours of points"};
}

Result<Outcomes> finish(const PlyHeader &header, const PlyRoles &roles, PlyBody &body, const Material &default_material,
                        Surface &surface) {
    Outcomes outcomes;
    surface.positions = std::move(body.positions);
    surface.triangles = std::move(body.triangles);
    surface.dropped_triangles = body.degenerate_triangles;
    if (roles.normal[0] != nullptr)
        outcomes.normals = roles.has_splats() ? PlyOutcome{Fate::converted, "the shapes of the splats give them"}
                                              : finish_normals(body, surface);
    if (roles.colour[0] != nullptr)
        outcomes.colours = finish_colours(roles, body, surface);
    if (roles.face_colour[0] != nullptr)
        outcomes.face_colours = finish_face_colours(roles, body, surface);
    if (!body.radii.empty())
        outcomes.radii = finish_radii(body, surface);
    const double scale = material_colour_scale(roles.material_red, body);
    for (const std::array<double, 10> &values : body.materials) {
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
           : role == PlyRole::splat          ? &outcomes.splats
           : role == PlyRole::byte           ? &outcomes.bytes[roles.byte_attribute(property)]
           : role == PlyRole::field          ? &property == roles.only_classes ? &outcomes.classes : &outcomes.fields
           : role == PlyRole::u || role == PlyRole::v || role == PlyRole::corner_places || role == PlyRole::image
               ? &outcomes.images
           : role != PlyRole::corners   ? &outcomes.materials
           : kind == PlyKind::face      ? &outcomes.faces
           : kind == PlyKind::tristrips ? &outcomes.strips
                                        : &outcomes.grid;
}

// One report line per group of consecutive properties with the same outcome or the same reason for their drop.
void report_element(const PlyElement &element, const PlyRoles &roles, const Outcomes &outcomes,
                    std::vector<AttributeReport> &report) {
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
        std::vector<std::string> names;
        for (std::size_t k = i; k < end; ++k)
            names.push_back(element.properties[k].name);
        const std::string name = printable(element.name) + "." + listed(names, " ");
        if (outcome != nullptr)
            report.push_back({name, outcome->fate, outcome->note});
        else
            report.push_back(
                {name, Fate::dropped,
                 std::string(drop_reason(element, first)) + (element.kind != PlyKind::vertex || first.is_list ? ""
                                                             : names.size() == 1 ? "; --field keeps it"
                                                                                 : "; --field NAME keeps one")});
        i = end;
    }
}

void write_report(const PlyHeader &header, const PlyRoles &roles, const Outcomes &outcomes, Surface &surface) {
    if (header.unknown_lines != 0)
        surface.report.push_back({"header", Fate::dropped,
                                  std::to_string(header.unknown_lines) +
                                      " lines of no meaning, the first begins with " +
                                      printable_in_quotes(header.first_unknown)});
    if (header.further_textures != 0)
        surface.report.push_back({std::to_string(header.further_textures) + " further texture images", Fate::dropped,
                                  "more than " + std::to_string(kMaxPlyTextures)});
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

// Whether faces, strips or a range grid connect the vertices. Without them the file is a cloud of points.
bool has_surface(const PlyHeader &header) {
    return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement &element) {
        return element.count != 0 && (element.kind == PlyKind::face || element.kind == PlyKind::tristrips ||
                                      element.kind == PlyKind::range_grid);
    });
}

// The numbers of vertices that are fields; they get that role. Clouds keep the usual ones as other laser scans do.
std::vector<FieldColumn> keep_fields(PlyHeader &header, PlyRoles &roles, const ReadOptions &options, Surface &surface) {
    const std::vector<PlyProperty *> numbers = free_numbers(header);
    std::vector<std::string> names;
    names.reserve(numbers.size());
    for (const PlyProperty *number : numbers)
        names.push_back(number->name);
    make_distinct(names);
    std::vector<FieldOffer> offers;
    offers.reserve(names.size());
    for (const std::string &name : names)
        offers.push_back({name});
    const std::vector<FieldColumn> columns = has_surface(header)
                                                 ? field_columns(surface, options, offers)
                                                 : field_columns(surface, options, offers, options.usual_fields);
    std::vector<FieldColumn> kept;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        numbers[i]->name = names[i];
        if (!columns[i].is_wanted())
            continue;
        numbers[i]->role = PlyRole::field;
        roles.fields.push_back(numbers[i]);
        kept.push_back(columns[i]);
        if (!columns[i].is_kept())
            roles.only_classes = numbers[i];
    }
    return kept;
}

} // namespace

Result<Surface> read_ply(const ScanFile &file, const ReadOptions &options) {
    const std::span<const std::uint8_t> bytes = file.bytes;
    Result<PlyHeader> header = read_ply_header(bytes);
    if (!header)
        return header.error();
    if (are_packed_splats(*header))
        return read_packed_splats(bytes, *header, options);
    Result<PlyRoles> roles = resolve_roles(*header);
    if (!roles)
        return roles.error();
    Surface surface;
    const std::vector<FieldColumn> fields = keep_fields(*header, *roles, options, surface);
    assign_splats(*header, *roles);
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

    for (std::size_t f = 0; f < fields.size(); ++f)
        for (const double value : body->fields[f])
            fields[f].add(value);
    const GaussianSplats splats = roles->has_splats() ? splats_of(*roles, *body) : GaussianSplats();
    body->fields.clear();
    Result<Outcomes> outcomes = finish(*header, *roles, *body, options.default_material, surface);
    if (!outcomes)
        return outcomes.error();
    for (const FieldColumn &column : fields)
        (column.is_kept() ? outcomes->fields : outcomes->classes).note = column.note();
    if (!header->texture_files.empty())
        outcomes->images = finish_images(file, *header, *body, surface);
    write_report(*header, *roles, *outcomes, surface);
    if (roles->has_splats())
        if (Status shown = show_discs(surface, splats, options); !shown)
            return shown.error();
    if (roles->splat_colours)
        turn_upright(surface);
    report_trailing(surface.report, trailing,
                    "after the last element, at byte " + std::to_string(bytes.size() - trailing));
    if (trailing == 0 && header->encoding == PlyEncoding::ascii && !ends_word(static_cast<char>(bytes.back())))
        report_open_end(surface.report);
    return finished(std::move(surface), options);
}

std::vector<NamedFile> files_of_ply(const ScanFile &file) {
    const Result<PlyHeader> header = read_ply_header(file.bytes);
    return header ? image_files(file, *header) : std::vector<NamedFile>();
}

} // namespace pbm::build
