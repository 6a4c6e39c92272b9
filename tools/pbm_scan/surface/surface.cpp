#include "pbm_scan/surface/surface.h"

#include "pbm_scan/surface/placeholders.h"
#include "pbm_scan/surface/refusal.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

namespace pbm::build {
namespace {

// What of the positions needs a closer look.
struct OddPositions {
    std::size_t not_finite = 0;
    bool may_be_placeholders = false;
};

OddPositions find_odd(std::span<const glm::dvec3> positions) {
    OddPositions odd;
    for (const glm::dvec3 &p : positions) {
        odd.not_finite += is_finite(p) ? 0U : 1U;
        odd.may_be_placeholders = odd.may_be_placeholders || may_be_placeholder(p);
    }
    return odd;
}

Status drop_non_finite(Surface &surface) {
    const std::size_t all = surface.positions.size();
    std::vector<std::uint8_t> is_bad(all);
    for (std::size_t i = 0; i < all; ++i)
        is_bad[i] = is_finite(surface.positions[i]) ? 0 : 1;
    const auto bad = static_cast<std::size_t>(std::count(is_bad.begin(), is_bad.end(), std::uint8_t{1}));
    if (bad == all)
        return bad_input("no vertex has finite coordinates: there is nothing to build");
    surface.dropped_triangles += erase_vertices(surface, is_bad);
    surface.dropped_vertices += bad;
    return {};
}

void drop_placeholders(Surface &surface) {
    Placeholders found;
    const std::vector<std::uint8_t> marks = mark_placeholders(surface.positions, 0, found);
    if (marks.empty())
        return;
    erase_vertices(surface, marks);
    surface.report.push_back({"placeholders", Fate::converted, found.note()});
}

// Removes points of the classes that the user does not want, and the classes unless they are a field.
void drop_classes(Surface &surface, const std::bitset<256> &dropped) {
    if (dropped.none())
        return;
    const std::vector<FieldValue> classes = std::exchange(surface.field_values[kMaxFields], {});
    if (classes.empty()) {
        surface.report.push_back(
            line_of(Warning::idle_option, "--drop-class",
                    "the file has no measurement named classification or class: no point is left out"));
        return;
    }
    std::vector<std::uint8_t> is_gone(classes.size());
    std::uint64_t gone = 0;
    for (std::size_t i = 0; i < classes.size(); ++i) {
        const double number = classes[i].number;
        const bool is_class = number >= 0 && number < 256 && number == std::floor(number);
        gone += is_gone[i] = is_class && dropped[static_cast<std::size_t>(number)] ? 1 : 0;
    }
    surface.dropped_triangles += erase_vertices(surface, is_gone);
    surface.report.push_back(
        {"--drop-class", Fate::kept, std::to_string(gone) + (gone == 1 ? " point" : " points") + " left out"});
}

Status refuse_drops(const Surface &surface) {
    for (const AttributeReport &line : surface.report)
        if (line.fate == Fate::dropped)
            return bad_input("--strict: " + line.name + " would be dropped (" + line.note +
                             "); remove it from the scan or leave --strict out");
    if (surface.dropped_vertices != 0)
        return bad_input("--strict: " + std::to_string(surface.dropped_vertices) +
                         " vertices have coordinates that are not finite; clean the scan or leave --strict out");
    if (surface.dropped_triangles != 0)
        return bad_input("--strict: " + std::to_string(surface.dropped_triangles) +
                         " triangles are degenerate; clean the scan or leave --strict out");
    return {};
}

} // namespace

std::size_t erase_vertices(Surface &surface, std::span<const std::uint8_t> removed) {
    assert(removed.size() == surface.positions.size());
    const auto first_point = static_cast<std::ptrdiff_t>(surface.first_point());
    if (!surface.triangles.empty())
        surface.points_beside_triangles -= static_cast<std::size_t>(
            std::count_if(removed.begin() + first_point, removed.end(), [](auto r) { return r != 0; }));
    const std::size_t erased = erase_triangles(
        surface, [&](const glm::uvec3 &t) { return removed[t.x] != 0 || removed[t.y] != 0 || removed[t.z] != 0; });
    std::vector<std::uint32_t> new_index(removed.size());
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < removed.size(); ++i)
        new_index[i] = removed[i] != 0 ? next : next++;
    for (glm::uvec3 &t : surface.triangles)
        t = {new_index[t.x], new_index[t.y], new_index[t.z]};
    const auto keep = [&](std::size_t i) { return removed[i] == 0; };
    keep_from(surface.positions, 0, keep);
    for_vertex_attributes([&](auto &values) { keep_from(values, 0, keep); }, surface);
    return erased;
}

Rgb8 colour_bytes(const glm::vec3 &colour, float factor) {
    Rgb8 bytes{};
    for (int i = 0; i < 3; ++i) {
        const float value = colour[i] * factor + 0.5F;
        bytes[static_cast<std::size_t>(i)] = value >= 0.0F ? static_cast<std::uint8_t>(std::min(value, 255.0F)) : 0;
    }
    return bytes;
}

Result<Surface> finished(Surface surface, const ReadOptions &options) {
    const OddPositions odd = find_odd(surface.positions);
    if (odd.not_finite != 0)
        if (Status status = drop_non_finite(surface); !status)
            return std::move(status).error();
    // A vertex of a mesh has its place in a face.
    if (odd.may_be_placeholders && !options.keep_placeholders && surface.triangles.empty())
        drop_placeholders(surface);
    const bool has_points = !surface.positions.empty();
    if (has_points)
        drop_classes(surface, options.dropped_classes);
    if (surface.positions.empty() && !options.is_one_of_several)
        return bad_input(has_points ? "--drop-class leaves no point: there is nothing to build"
                                    : "the file has no vertices: there is nothing to build");
    if (!has_points)
        surface.report.push_back({"points", Fate::kept, "the file has none"});
    if (options.strict)
        if (Status status = refuse_drops(surface); !status)
            return std::move(status).error();
    return surface;
}

} // namespace pbm::build
