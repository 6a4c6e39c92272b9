// Normals and colours as OBJ and OFF give them.
#pragma once

#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/surface/surface.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
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

inline constexpr glm::vec3 kNoColour(std::numeric_limits<float>::quiet_NaN()); // of a vertex without one

// `colours`: of the vertices, in any range (colour_range.h). `of_faces`: what became of face colours, empty if they are
// the vertices' own. `colour_without(vertex)`: the colour of a vertex that has kNoColour.
template <class ColourWithout>
void keep_colours(const std::vector<glm::vec3> &colours, const std::string &of_faces, Surface &surface,
                  const ColourWithout &colour_without) {
    if (colours.empty())
        return;
    const ColourRange range = colour_range(colours, ColourNumbers::any);
    const char *name = of_faces.empty() ? "vertex colours" : "face colours";
    if (range.white == 0) {
        surface.report.push_back({name, Fate::dropped, "nearly all are above 65,535: these are no colours"});
        return;
    }
    std::uint64_t without = 0;
    surface.colours.reserve(colours.size());
    for (const glm::vec3 &c : colours) {
        const bool has_none = std::isnan(c.x) && std::isnan(c.y) && std::isnan(c.z);
        without += has_none ? 1U : 0U;
        surface.colours.push_back(has_none ? colour_without(surface.colours.size()) : colour_bytes(c, range.factor()));
    }
    std::string note = of_faces.empty() ? range.white == 65535 ? "sRGB, 16 bits to 8" : "sRGB, 8 bits" : of_faces;
    note += range.note();
    if (without != 0)
        note += "; " + counted(without, "vertex") + " without one " + (without == 1 ? "has" : "have") +
                " that of the material";
    surface.report.push_back({name, of_faces.empty() ? Fate::kept : Fate::converted, std::move(note)});
}

} // namespace pbm::build
