// Normals and colours as OBJ and OFF give them.
#pragma once

#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/surface/surface.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// Makes normals without a direction zero, or removes all if none has one. `note`: of the report.
inline void keep_normals(Surface &surface, std::string note) {
    constexpr float kMinLength = 1e-6F;
    if (surface.normals.empty())
        return;
    std::size_t absent = 0;
    for (glm::vec3 &n : surface.normals) {
        const float length = glm::length(n);
        if (!std::isfinite(length) || length < kMinLength)
            n = glm::vec3(0.0F);
        absent += n == glm::vec3(0.0F) ? 1U : 0U;
    }
    if (absent == surface.normals.size()) {
        surface.normals.clear();
        surface.report.push_back({"normals", Fate::converted, "all are zero: estimated anew"});
        return;
    }
    if (absent != 0)
        note += "; " + std::to_string(absent) + " vertices have none: taken from their faces";
    surface.report.push_back({"normals", Fate::kept, std::move(note)});
}

// Reports colours of vertices or faces, and returns their range. Nothing: they are no colours. `of`: "vertex" or
// "triangle".
inline std::optional<ColourRange> report_colours(const char *name, const char *of, std::span<const glm::vec3> colours,
                                                 Surface &surface) {
    const ColourRange range = colour_range(colours, ColourNumbers::any);
    if (range.white == 0) {
        surface.report.push_back({name, Fate::dropped, "nearly all are above 65,535: these are no colours"});
        return std::nullopt;
    }
    std::string note = range.white == 65535 ? "sRGB, 16 bits to 8" : "sRGB, 8 bits";
    note += range.note();
    if (const auto without = std::count_if(colours.begin(), colours.end(), is_no_colour); without != 0)
        note += "; " + counted(static_cast<std::uint64_t>(without), of) + " without one " +
                (without == 1 ? "has" : "have") + " that of the material";
    surface.report.push_back({name, Fate::kept, std::move(note)});
    return range;
}

// `colours`: of the vertices, in any range (colour_range.h). `colour_without(vertex)`: the colour of a vertex that has
// kNoColour.
template <class ColourWithout>
void keep_colours(const std::vector<glm::vec3> &colours, Surface &surface, const ColourWithout &colour_without) {
    if (colours.empty())
        return;
    const std::optional<ColourRange> range = report_colours("vertex colours", "vertex", colours, surface);
    if (!range)
        return;
    surface.colours.reserve(colours.size());
    for (const glm::vec3 &c : colours)
        surface.colours.push_back(is_no_colour(c) ? colour_without(surface.colours.size())
                                                  : colour_bytes(c, range->factor()));
}

// `colours`: of the triangles, in any range, or kNoColour.
inline void keep_face_colours(std::span<const glm::vec3> colours, Surface &surface) {
    if (colours.empty())
        return;
    if (const auto range = report_colours("face colours", "triangle", colours, surface))
        surface.face_colours = face_colours(colours, *range);
}

} // namespace pbm::build
