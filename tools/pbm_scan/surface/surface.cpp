#include "pbm_scan/surface/surface.h"

#include "pbm_scan/surface/refusal.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

namespace pbm::build {
namespace {

Status drop_non_finite(Surface &surface) {
    std::vector<std::uint8_t> is_bad(surface.positions.size());
    std::size_t bad = 0;
    for (std::size_t i = 0; i < is_bad.size(); ++i)
        bad += is_bad[i] = is_finite(surface.positions[i]) ? 0 : 1;
    if (bad != 0 && bad == surface.positions.size())
        return bad_input("no vertex has finite coordinates: there is nothing to build");
    if (bad == 0)
        return {};
    surface.dropped_triangles += erase_vertices(surface, is_bad);
    surface.dropped_vertices += bad;
    return {};
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

MeanColours mean_colours(std::span<const glm::vec4> sums, const char *face) {
    MeanColours means;
    for (const glm::vec4 &sum : sums) {
        means.colours.push_back(sum.w > 0 ? glm::vec3(sum) / sum.w : glm::vec3(0.0F));
        means.without += sum.w > 0 ? 0U : 1U;
    }
    means.note = "each vertex has the mean of its faces, sRGB, 8 bits";
    if (means.without != 0)
        means.note += "; " + std::to_string(means.without) + " vertices without " + face + " are black";
    return means;
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
    if (Status status = drop_non_finite(surface); !status)
        return std::move(status).error();
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
