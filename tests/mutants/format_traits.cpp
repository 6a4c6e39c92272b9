#include "mutants/format_traits.h"

#include <algorithm>
#include <array>

namespace pbm::mutants {
namespace {

using build::AttributeReport;
using build::Surface;

const std::string kCut = "it was cut", kCutUnsaid = "it was cut inside a number, unsaid";

// Texts: a cut inside the last number cannot be detected, so the reader must say that the end of the file may be
// missing.
std::string unless_said(const Surface &s) {
    const bool is_said = std::any_of(s.report.begin(), s.report.end(),
                                     [](const AttributeReport &line) { return line.name == "end of file"; });
    return is_said ? "" : kCutUnsaid;
}

std::size_t end_of(const std::string &honest) { return honest.find_last_not_of("\r\n") + 1; }

std::string always(const Mutant & /*mutant*/, const Surface & /*surface*/) { return kCut; }

// A cut inside the records behind the points of a LAS loses those alone.
std::string las(const Mutant & /*mutant*/, const Surface &s) {
    const bool is_said = std::any_of(s.report.begin(), s.report.end(),
                                     [](const AttributeReport &line) { return line.name == "announced records"; });
    return is_said ? "" : kCut;
}

// Behind the XML section of an E57 are zeros that fill the last page.
std::string before_end(const Mutant &mutant, const Surface & /*surface*/) {
    return *mutant.cut_at < end_of(mutant.origin->bytes) ? kCut : "";
}

// Texts whose header counts the rows.
std::string inside_last_number(const Mutant &mutant, const Surface &s) {
    const std::string &honest = mutant.origin->bytes;
    const std::size_t cut = *mutant.cut_at, end = end_of(honest);
    if (cut >= end)
        return "";
    return cut <= honest.find_last_of(" \n", end - 1) + 1 ? kCut : unless_said(s);
}

// Face colours are optional, so whole numbers of the last line may be missing.
std::string off(const Mutant &mutant, const Surface &s) {
    const std::string &honest = mutant.origin->bytes;
    const std::size_t cut = *mutant.cut_at, end = end_of(honest);
    return mutant.origin->name != kFreeText && cut < end && cut > honest.rfind('\n', end - 1) + 7
               ? unless_said(s)
               : inside_last_number(mutant, s);
}

// Undetectable between two solids and within the name of the last line.
std::string stl_ascii(const Mutant &mutant, const Surface & /*surface*/) {
    const std::size_t last_line = mutant.bytes.rfind('\n', mutant.bytes.find_last_not_of('\n')) + 1;
    const std::string begin = mutant.bytes.substr(last_line, 9);
    const bool has_end = mutant.origin->name == kFreeText ? mutant.bytes.find("endsolid") != std::string::npos
                                                          : begin.starts_with("endsolid") || begin == "end solid";
    return has_end ? "" : kCut;
}

// Undetectable between two lines, except by comments.
std::string obj(const Mutant &mutant, const Surface &s) {
    const std::string &honest = mutant.origin->bytes;
    const std::size_t cut = *mutant.cut_at;
    if (cut == 0 || honest[cut - 1] == '\n' || cut >= end_of(honest))
        return "";
    const std::size_t line = honest.rfind('\n', cut - 1) + 1; // npos + 1 is 0
    const bool numbers = std::string("vf").find(honest[line]) != std::string::npos && honest.substr(line, 2) != "vt";
    return numbers ? unless_said(s) : "";
}

// Undetectable between two scans, and inside the last number before.
std::string ptx(const Mutant &mutant, const Surface &s) {
    const std::string &honest = mutant.origin->bytes;
    const std::size_t cut = *mutant.cut_at, second = honest.rfind("5\n5\n");
    if (cut == second)
        return "";
    return cut < second && cut > honest.rfind(' ', second) + 1 ? unless_said(s) : inside_last_number(mutant, s);
}

// Undetectable between two rows, unless the rows are counted.
std::string table(const Mutant &mutant, const Surface &s) {
    const std::string &honest = mutant.origin->bytes;
    const std::size_t cut = *mutant.cut_at;
    if (mutant.origin->name == "counted")
        return inside_last_number(mutant, s);
    return honest[cut - 1] == '\n' || cut >= end_of(honest) ? "" : unless_said(s);
}

constexpr std::array<FormatTraits, kFormats> kTraits{{{"PLY ASCII", "ply", count_ply, inside_last_number},
                                                      {"PLY binary", "ply", count_ply, always},
                                                      {"OBJ", "obj", count_obj, obj},
                                                      {"OFF", "off", count_off, off},
                                                      {"STL ASCII", "stl", count_stl, stl_ascii},
                                                      {"STL binary", "stl", count_stl, always},
                                                      {"PTX", "ptx", count_ptx, ptx},
                                                      {"E57", "e57", count_e57, before_end},
                                                      {"LAS", "las", count_las, las},
                                                      {"LAZ", "las", count_las, always},
                                                      {"SPZ", "spz", count_spz, always},
                                                      {"PCD ASCII", "pcd", count_pcd, inside_last_number},
                                                      {"PCD binary", "pcd", count_pcd, always},
                                                      {"tables", "xyz", count_table, table},
                                                      {"glTF", "gltf", count_gltf, always}}};

} // namespace

const FormatTraits &traits(Format format) { return kTraits[static_cast<std::size_t>(format)]; }

} // namespace pbm::mutants
