#include "pbm_scan/ply_reader.h"

#include "pbm_scan/ply_body.h"
#include "pbm_scan/ply_roles.h"
#include "pbm_scan/text_lines.h"
#include "pbm_scan/text_number.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace pbm::build {
namespace {

using Fate = AttributeReport::Fate;

// What became of a group of properties; ends up in the report.
struct Outcome {
    Fate fate = Fate::kept;
    std::string note;
};

struct Outcomes {
    Outcome positions, normals, colours, face_colours, radii, material_ids, faces, strips, materials;
};

// Factor from the file's colours to 0..255; zero where the numbers are no colours. The type alone does not tell:
// floats in 0..255 and ushorts that never leave a byte are common.
float colour_factor(PlyScalar type, float highest) {
    if (is_float(type) && highest <= 1.0F)
        return 255.0F;
    if (highest <= 255.0F)
        return 1.0F;
    return highest <= 65535.0F ? 255.0F / 65535.0F : 0.0F;
}

std::array<std::uint8_t, 3> to_bytes(const glm::vec3 &colour, float factor) {
    std::array<std::uint8_t, 3> bytes{};
    for (int i = 0; i < 3; ++i) {
        const float value = colour[i] * factor + 0.5F;
        bytes[static_cast<std::size_t>(i)] =
            value >= 0.0F ? static_cast<std::uint8_t>(std::min(value, 255.0F)) : 0; // NaN: 0
    }
    return bytes;
}

// Also for means of faces, where they stand per vertex already.
Outcome convert_colours(PlyScalar type, std::vector<glm::vec3> &wide, Surface &surface) {
    float highest = 0;
    for (glm::vec3 &colour : wide)
        for (int i = 0; i < 3; ++i) {
            if (type == PlyScalar::int8 && colour[i] < 0)
                colour[i] += 256; // a byte that was declared with a sign
            if (std::isfinite(colour[i]))
                highest = std::max(highest, colour[i]);
        }
    const float factor = colour_factor(type, highest);
    if (factor == 0.0F)
        return {Fate::dropped, "values up to " + number_text(static_cast<double>(highest)) + " are no colours"};
    surface.colours.reserve(wide.size());
    for (const glm::vec3 &colour : wide)
        surface.colours.push_back(to_bytes(colour, factor));
    const char *range = factor == 1.0F ? "0..255" : factor == 255.0F ? "0..1" : "0..65535";
    return {Fate::converted, std::string(to_string(type)) + " in " + range + " to sRGB of 8 bits"};
}

Outcome finish_colours(const PlyElement &vertex, PlyBody &body, Surface &surface) {
    surface.colours = std::move(body.colours);
    if (body.wide_colours.empty())
        return {Fate::kept, "sRGB, 8 bits"};
    PlyScalar type = PlyScalar::int8; // the widest of the three
    for (const PlyRole role : {PlyRole::red, PlyRole::green, PlyRole::blue})
        type = std::max(type, find_property(vertex, role)->type);
    return convert_colours(type, body.wide_colours, surface);
}

Outcome finish_face_colours(const PlyElement &face, PlyBody &body, Surface &surface) {
    std::vector<glm::vec3> means(body.face_colours.size(), glm::vec3(0.0F));
    std::size_t without = 0;
    for (std::size_t i = 0; i < means.size(); ++i) {
        const glm::vec4 &sum = body.face_colours[i];
        if (sum.w > 0)
            means[i] = glm::vec3(sum) / sum.w;
        else
            ++without;
    }
    if (without == means.size())
        return {Fate::dropped, "no vertex belongs to a face"};
    Outcome outcome = convert_colours(find_property(face, PlyRole::red)->type, means, surface);
    if (outcome.fate != Fate::dropped) {
        outcome.note = "each vertex has the mean of its faces, sRGB, 8 bits";
        if (without != 0)
            outcome.note += "; " + std::to_string(without) + " vertices without a face are black";
    }
    return outcome;
}

Outcome finish_normals(PlyBody &body, Surface &surface) {
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

Outcome finish_radii(PlyBody &body, Surface &surface) {
    std::size_t bad = 0;
    for (const float radius : body.radii)
        bad += radius > 0.0F && std::isfinite(radius) ? 0U : 1U;
    if (bad != 0)
        return {Fate::dropped, std::to_string(bad) + " are not positive: radii are chosen anew"};
    surface.radii = std::move(body.radii);
    return {Fate::kept, "splat radius"};
}

Result<SurfaceMaterial> finish_material(const std::array<double, 8> &values, std::size_t row, double colour_scale) {
    const auto refuse = [row](const char *name, const char *range) {
        return Error{ErrorCode::bad_input, 0, "material " + std::to_string(row) + ": " + name + " must be in " + range};
    };
    SurfaceMaterial material;
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

// Colours are 0..255 where any is above 1, or where the type is whole numbers.
double material_colour_scale(const PlyElement &element, const PlyBody &body) {
    const PlyProperty *red = find_property(element, PlyRole::clr_r);
    bool unit = red == nullptr || is_float(red->type);
    for (const std::array<double, 8> &values : body.materials)
        for (std::size_t i = 4; i < 7; ++i)
            unit = unit && !(values[i] > 1.0);
    return unit ? 255.0 : 1.0;
}

Result<Outcome> finish_material_ids(const PlyBody &body, Surface &surface) {
    if (surface.materials.empty())
        return Outcome{Fate::dropped, "the file has no element material with ka, kd, ks..."};
    surface.material_ids.reserve(body.material_ids.size());
    for (std::size_t i = 0; i < body.material_ids.size(); ++i) {
        const float id = body.material_ids[i];
        if (!(id >= 0 && id < static_cast<float>(surface.materials.size()) && id == std::floor(id)))
            return Error{ErrorCode::bad_input, 0,
                         "vertex " + std::to_string(i) + " has material " + number_text(static_cast<double>(id)) +
                             ", but there are " + std::to_string(surface.materials.size()) + "; export the scan again"};
        surface.material_ids.push_back(static_cast<std::uint8_t>(id));
    }
    return Outcome{Fate::kept, "material"};
}

Result<Outcomes> finish(const PlyHeader &header, PlyBody &body, Surface &surface) {
    Outcomes outcomes;
    const PlyElement &vertex = *find_element(header, PlyKind::vertex);
    surface.positions = std::move(body.positions);
    surface.triangles = std::move(body.triangles);
    surface.dropped_triangles = body.degenerate_triangles;
    if (find_property(vertex, PlyRole::nx) != nullptr)
        outcomes.normals = finish_normals(body, surface);
    if (find_property(vertex, PlyRole::red) != nullptr)
        outcomes.colours = finish_colours(vertex, body, surface);
    if (!body.face_colours.empty())
        outcomes.face_colours = finish_face_colours(*find_element(header, PlyKind::face), body, surface);
    if (!body.radii.empty())
        outcomes.radii = finish_radii(body, surface);
    if (const PlyElement *material = find_element(header, PlyKind::material)) {
        const double scale = material_colour_scale(*material, body);
        for (const std::array<double, 8> &values : body.materials) {
            Result<SurfaceMaterial> finished = finish_material(values, surface.materials.size(), scale);
            if (!finished)
                return finished.error();
            surface.materials.push_back(*finished);
        }
    }
    if (!body.material_ids.empty()) {
        Result<Outcome> ids = finish_material_ids(body, surface);
        if (!ids)
            return ids.error();
        outcomes.material_ids = *ids;
    }
    outcomes.positions.note = "positions";
    outcomes.faces = {Fate::kept, "polygons as fans of triangles"};
    outcomes.strips = {Fate::converted, "strips to triangles"};
    outcomes.materials.note = "material";
    return outcomes;
}

const Outcome *outcome_of(const PlyElement &element, const PlyProperty &property, const Outcomes &outcomes) {
    const PlyRole role = property.role;
    if (role == PlyRole::none)
        return nullptr;
    if (role <= PlyRole::z)
        return &outcomes.positions;
    if (role <= PlyRole::nz)
        return &outcomes.normals;
    if (role <= PlyRole::blue)
        return element.kind == PlyKind::vertex ? &outcomes.colours : &outcomes.face_colours;
    if (role == PlyRole::radius)
        return &outcomes.radii;
    if (role == PlyRole::material_index)
        return &outcomes.material_ids;
    if (role == PlyRole::corners)
        return element.kind == PlyKind::face ? &outcomes.faces : &outcomes.strips;
    return &outcomes.materials;
}

// One line per group: neighbours with the same outcome, or dropped for the same reason.
void report_element(const PlyElement &element, const Outcomes &outcomes, std::vector<AttributeReport> &report) {
    constexpr std::size_t kMostNames = 4; // of more, the first and the last one stand for all
    for (std::size_t i = 0; i < element.properties.size();) {
        const PlyProperty &first = element.properties[i];
        const Outcome *outcome = outcome_of(element, first, outcomes);
        const auto belongs = [&](const PlyProperty &next) {
            return outcome_of(element, next, outcomes) == outcome &&
                   (outcome != nullptr || drop_reason(element, next) == drop_reason(element, first));
        };
        std::size_t end = i + 1;
        while (end < element.properties.size() && belongs(element.properties[end]))
            ++end;
        std::string name = printable(element.name + "." + first.name);
        if (end - i > kMostNames)
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

void write_report(const PlyHeader &header, const Outcomes &outcomes, Surface &surface) {
    if (header.unknown_lines != 0)
        surface.report.push_back({"header", Fate::dropped,
                                  std::to_string(header.unknown_lines) +
                                      " lines of no meaning, the first begins with " + quoted(header.first_unknown)});
    for (const std::string &file : header.texture_files)
        surface.report.push_back({"texture image " + quoted(file), Fate::dropped, "PBM stores point colours"});
    for (const PlyElement &element : header.elements) {
        if (element.kind != PlyKind::skipped)
            report_element(element, outcomes, surface.report);
        else if (element.count != 0 && !element.properties.empty()) {
            const std::string name = quoted(element.name);
            surface.report.push_back({"element " + name, Fate::dropped, std::string(drop_reason(element))});
        }
    }
}

// Bytes after the last row; white space there is nothing to speak of.
std::size_t trailing_bytes(std::span<const std::uint8_t> bytes, const PlyHeader &header, std::size_t at) {
    std::size_t word = at;
    while (word < bytes.size() && ends_word(static_cast<char>(bytes[word])))
        ++word;
    return word == bytes.size() || header.encoding == PlyEncoding::ascii ? bytes.size() - word : bytes.size() - at;
}

// How many bytes a transfer in text mode has inserted: a CR in front of every LF of a binary body. 0: it was none.
// Few such pairs may be chance.
std::size_t translated_line_ends(std::span<const std::uint8_t> bytes, const PlyHeader &header) {
    constexpr std::size_t kNoChance = 4;
    if (header.encoding == PlyEncoding::ascii)
        return 0;
    std::size_t inserted = 0;
    for (std::size_t i = header.body_offset; i < bytes.size(); ++i)
        if (bytes[i] == '\n') {
            if (i == header.body_offset || bytes[i - 1] != '\r')
                return 0;
            ++inserted;
        }
    return inserted >= kNoChance ? inserted : 0;
}

Error translated_error(const PlyHeader &header) {
    return Error{ErrorCode::bad_input, header.body_offset,
                 "a transfer has translated the line ends of this binary file; copy it again in binary mode"};
}

} // namespace

Result<Surface> read_ply(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    Result<PlyHeader> header = read_ply_header(bytes);
    if (!header)
        return header.error();
    if (const Status status = assign_roles(*header); !status)
        return status.error();
    Result<PlyBody> body = read_ply_body(bytes, *header, options);
    const std::size_t inserted = translated_line_ends(bytes, *header);
    if (!body)
        return inserted != 0 ? translated_error(*header) : body.error();
    const std::size_t trailing = trailing_bytes(bytes, *header, body->end_offset);
    if (inserted != 0 && trailing != 0 && trailing <= inserted)
        return translated_error(*header);

    Surface surface;
    const Result<Outcomes> outcomes = finish(*header, *body, surface);
    if (!outcomes)
        return outcomes.error();
    write_report(*header, *outcomes, surface);
    if (trailing != 0)
        surface.report.push_back({"end of file", Fate::dropped,
                                  std::to_string(trailing) + " bytes after the last element, at byte " +
                                      std::to_string(bytes.size() - trailing)});
    else if (header->encoding == PlyEncoding::ascii && !ends_word(static_cast<char>(bytes.back())))
        report_open_end(surface.report);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
