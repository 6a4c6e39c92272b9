// Normals and colours as OBJ and OFF give them.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
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

// `colours`: of the vertices, 0..1 or 0..255. `of_faces`: what became of face colours, empty if they are the vertices'
// own.
inline void keep_colours(const std::vector<glm::vec3> &colours, const std::string &of_faces, Surface &surface) {
    if (colours.empty())
        return;
    float highest = 0;
    for (const glm::vec3 &c : colours)
        highest = std::max(highest, std::max(c.x, std::max(c.y, c.z)));
    const char *name = of_faces.empty() ? "vertex colours" : "face colours";
    if (!(highest <= 255.0F)) {
        surface.report.push_back({name, Fate::dropped, "values above 255 are no colours"});
        return;
    }
    const float factor = highest <= 1.0F ? 255.0F : 1.0F;
    surface.colours.reserve(colours.size());
    for (const glm::vec3 &c : colours)
        surface.colours.push_back(colour_bytes(c, factor));
    surface.report.push_back(of_faces.empty() ? AttributeReport{name, Fate::kept, "sRGB, 8 bits"}
                                              : AttributeReport{name, Fate::converted, of_faces});
}

} // namespace pbm::build
