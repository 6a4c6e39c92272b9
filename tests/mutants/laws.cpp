#include "mutants/laws.h"

#include "mutants/count.h"
#include "pbm_scan/e57/e57_reader.h"
#include "pbm_scan/mesh/mesh_reader.h"
#include "pbm_scan/ply/ply_reader.h"
#include "pbm_scan/ptx/ptx_reader.h"
#include "unit/scan/e57_files.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace pbm::mutants {
namespace {

using build::AttributeReport;
using build::Surface;

Result<Surface> read(Format format, const std::string &text) {
    const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t *>(text.data()), text.size());
    switch (format) {
    case Format::ply_ascii:
    case Format::ply_binary: return build::read_ply({bytes}, {});
    case Format::obj: return build::read_obj({bytes}, {});
    case Format::off: return build::read_off(bytes, {});
    case Format::ptx: return build::read_ptx(bytes, {});
    case Format::e57: return build::read_e57(bytes, {});
    case Format::stl_ascii:
    case Format::stl_binary: break;
    }
    return build::read_stl(bytes, {});
}

Judgement broken(const std::string &law) { return {Verdict::broken, law}; }

// An error must be one line without control characters, and its code must blame the file.
Judgement judge_error(const Error &error, std::size_t size) {
    const auto plain = [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f; };
    if (error.message.empty() || !std::all_of(error.message.begin(), error.message.end(), plain))
        return broken("the error is not one plain line: " + error.message);
    if (error.offset > size)
        return broken("the error lies beyond the file: " + error.message);
    const int code = exit_code(error.code);
    if (code != 3 && code != 5)
        return broken("the file is not to blame: " + error.message);
    for (const char *accident : {"crashed", "ended early", "was stopped", "was ended", "reader failed", "astray"})
        if (error.message.find(accident) != std::string::npos)
            return broken("an accident that the checks should have seen coming: " + error.message);
    return {code == 3 ? Verdict::refused : Verdict::unsupported, error.message};
}

bool whole(const Surface &s) {
    const std::size_t count = s.positions.size();
    const auto parallel = [count](const auto &values) { return values.empty() || values.size() == count; };
    const auto finite = [](const glm::dvec3 &p) {
        return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    };
    const auto valid = [count](const glm::uvec3 &t) {
        return t.x < count && t.y < count && t.z < count && t.x != t.y && t.y != t.z && t.x != t.z;
    };
    return count != 0 && parallel(s.normals) && parallel(s.colours) && parallel(s.radii) && parallel(s.material_ids) &&
           parallel(s.station_ids) && std::all_of(s.positions.begin(), s.positions.end(), finite) &&
           std::all_of(s.triangles.begin(), s.triangles.end(), valid);
}

bool reports(const Surface &s, const std::string &name) {
    return std::any_of(s.report.begin(), s.report.end(),
                       [&](const AttributeReport &line) { return line.name == name; });
}

// A truncated file must be refused. Exceptions are texts: without its last line end a text is complete, and a cut
// inside the last number cannot be detected, so the reader must report that the end of the file may be missing.
std::optional<std::string> judge_cut(const Mutant &mutant, const Surface &s) {
    const std::string &honest = mutant.origin->bytes;
    const std::size_t cut = *mutant.cut_at;
    const std::size_t end = honest.find_last_not_of("\r\n") + 1;
    switch (mutant.origin->format) {
    case Format::ply_binary:
    case Format::stl_binary: return "it was cut";
    case Format::e57: // behind the XML section are zeros that fill the last page
        return cut < end ? std::optional<std::string>("it was cut") : std::nullopt;
    case Format::stl_ascii: { // undetectable between two solids and within the name of the last line
        const std::size_t last_line = mutant.bytes.rfind('\n', mutant.bytes.find_last_not_of('\n')) + 1;
        return mutant.bytes.substr(last_line, 8) != "endsolid" ? std::optional<std::string>("it was cut")
                                                               : std::nullopt;
    }
    case Format::obj: { // undetectable between two lines, except by comments
        if (cut == 0 || honest[cut - 1] == '\n' || cut >= end)
            return std::nullopt;
        const std::size_t line = honest.rfind('\n', cut - 1) + 1; // npos + 1 is 0
        const bool numbers =
            std::string("vf").find(honest[line]) != std::string::npos && honest.substr(line, 2) != "vt";
        return numbers && !reports(s, "end of file") ? std::optional<std::string>("it was cut inside a line, unsaid")
                                                     : std::nullopt;
    }
    case Format::ptx: { // undetectable between two scans, and inside the last number before
        const std::size_t second = honest.rfind("5\n5\n");
        if (cut == second)
            return std::nullopt;
        if (cut < second && cut > honest.rfind(' ', second) + 1)
            return reports(s, "end of file") ? std::nullopt
                                             : std::optional<std::string>("it was cut inside a number, unsaid");
        break;
    }
    case Format::ply_ascii:
    case Format::off: break;
    }
    if (cut >= end)
        return std::nullopt;
    const std::size_t last_word = honest.find_last_of(" \n", end - 1) + 1;
    // Face colours of OFF are optional, so whole numbers of the last line may be missing.
    const std::size_t last_line = honest.rfind('\n', end - 1) + 1;
    const bool optional = mutant.origin->format == Format::off && cut > last_line + 6;
    if (cut <= last_word && !optional)
        return "it was cut";
    return reports(s, "end of file") ? std::nullopt : std::optional<std::string>("it was cut inside a number, unsaid");
}

Judgement judge_surface(const Mutant &mutant, const Surface &s) {
    if (!whole(s))
        return broken("the arrays of the surface disagree");
    if (mutant.cut_at)
        if (const std::optional<std::string> law = judge_cut(mutant, s))
            return broken(*law);
    const Format format = mutant.origin->format;
    const std::optional<Announced> announced = count(format, mutant.bytes);
    if (!announced)
        return broken("loaded " + std::to_string(s.positions.size()) + " vertices of a file that cannot be counted");
    const std::uint64_t vertices = s.positions.size() + s.dropped_vertices - s.vertex_copies;
    const bool stl = format == Format::stl_ascii || format == Format::stl_binary;
    if (!stl && vertices != announced->vertices)
        return broken(std::to_string(vertices) + " vertices where the file has " + std::to_string(announced->vertices));
    const std::uint64_t triangles = s.triangles.size() + s.dropped_triangles;
    if (triangles < announced->min_triangles || triangles > announced->max_triangles)
        return broken(std::to_string(triangles) + " triangles where the file has " +
                      std::to_string(announced->min_triangles) + ".." + std::to_string(announced->max_triangles));
    bool dropped = s.dropped_vertices != 0 || s.dropped_triangles != 0;
    for (const AttributeReport &line : s.report)
        dropped = dropped || line.fate == AttributeReport::Fate::dropped;
    if (announced->something_unknown && !dropped)
        return broken("something was left out, unsaid");
    return {dropped ? Verdict::loaded_less : Verdict::loaded, ""};
}

} // namespace

Judgement judge(const Mutant &mutant) {
    const Format format = mutant.origin->format;
    const std::string file = format == Format::e57 ? test::e57_with_length(mutant.bytes) : mutant.bytes;
    const Result<Surface> surface = read(format, file);
    return surface ? judge_surface(mutant, *surface) : judge_error(surface.error(), file.size());
}

} // namespace pbm::mutants
