#include "mutants/laws.h"

#include "mutants/format_traits.h"
#include "pbm_scan/formats.h"
#include "unit/scan/e57_files.h"

#include <algorithm>
#include <cstdlib>

namespace pbm::mutants {
namespace {

using build::AttributeReport;
using build::Surface;

Result<Surface> read(const FormatTraits &format, const std::string &text) {
    const build::ReadOptions options{.min_opacity = 0, // no splat is left out
                                     .fields = {"intensity", "classification", "quality", "confidence"}};
    const auto formats = build::scan_formats();
    const auto found = std::find_if(formats.begin(), formats.end(),
                                    [&](const build::ScanFormat &f) { return f.name == format.scan_format; });
    return found->read({{reinterpret_cast<const std::uint8_t *>(text.data()), text.size()}}, options);
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
    bool parallel = true;
    build::for_vertex_attributes(
        [&](const auto &values) { parallel = parallel && (values.empty() || values.size() == count); }, s);
    const auto valid = [count](const glm::uvec3 &t) {
        return t.x < count && t.y < count && t.z < count && t.x != t.y && t.y != t.z && t.x != t.z;
    };
    return count != 0 && parallel && std::all_of(s.positions.begin(), s.positions.end(), build::is_finite) &&
           std::all_of(s.triangles.begin(), s.triangles.end(), valid);
}

// How many points or rows the report says were left out.
std::uint64_t left_out(const Surface &s) {
    std::uint64_t sum = 0;
    for (const AttributeReport &line : s.report)
        if (line.note.find("left out") != std::string::npos)
            for (const char *const kind : {" point", " row"})
                for (std::size_t at = 0; (at = line.note.find(kind, at)) != std::string::npos; ++at) {
                    const std::size_t before = line.note.find_last_not_of("0123456789", at - 1) + 1;
                    sum += std::strtoull(line.note.substr(before, at - before).c_str(), nullptr, 10);
                }
    return sum;
}

Judgement judge_surface(const Mutant &mutant, const Surface &s) {
    if (!whole(s))
        return broken("the arrays of the surface disagree");
    const FormatTraits &format = traits(mutant.origin->format);
    if (mutant.cut_at && *mutant.cut_at < mutant.origin->bytes.size() - mutant.origin->bytes_behind)
        if (const std::string law = format.judge_cut(mutant, s); !law.empty())
            return broken(law);
    const std::optional<Announced> announced = format.count(mutant.bytes);
    if (!announced)
        return broken("loaded " + std::to_string(s.positions.size()) + " vertices of a file that cannot be counted");
    const std::uint64_t vertices = s.positions.size() + s.dropped_vertices - s.vertex_copies + left_out(s);
    const bool is_stl = format.scan_format == "stl"; // equal corners are welded
    // A header of LAS may lie, if the report says so.
    const bool is_said = std::any_of(s.report.begin(), s.report.end(), [&](const AttributeReport &line) {
        return line.name == "header" && line.note.ends_with("; the file has " + std::to_string(vertices));
    });
    const bool is_right =
        vertices <= announced->vertices && vertices + announced->unnamed_vertices >= announced->vertices;
    if (!is_stl && !is_said && !is_right)
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
    const FormatTraits &format = traits(mutant.origin->format);
    const std::string file = format.scan_format == "e57" ? test::e57_with_length(mutant.bytes) : mutant.bytes;
    const Result<Surface> surface = read(format, file);
    return surface ? judge_surface(mutant, *surface) : judge_error(surface.error(), file.size());
}

} // namespace pbm::mutants
