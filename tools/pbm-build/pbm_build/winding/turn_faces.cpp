#include "pbm_build/winding/turn_faces.h"

#include "pbm_build/surface/face_normal.h"

#include <glm/geometric.hpp>

#include <limits>

namespace pbm::build {
namespace {

std::uint64_t turn_normals(Surface &surface, std::span<const std::uint8_t> turn) {
    // [positions] how far the normal agrees with its faces before they are turned; NaN: one of them is not turned
    std::vector<double> agreement(surface.normals.size());
    for (std::size_t i = 0; i < turn.size(); ++i) {
        const glm::uvec3 &t = surface.triangles[i];
        const glm::dvec3 normal = face_normal(surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]);
        if (normal == glm::dvec3(0)) // looks nowhere
            continue;
        for (int corner = 0; corner < 3; ++corner)
            agreement[t[corner]] += turn[i] != 0 ? glm::dot(normal, glm::dvec3(surface.normals[t[corner]]))
                                                 : std::numeric_limits<double>::quiet_NaN();
    }
    std::uint64_t turned = 0;
    for (std::size_t i = 0; i < agreement.size(); ++i)
        if (agreement[i] > 0) {
            surface.normals[i] = -surface.normals[i];
            if (!surface.tangents.empty())
                surface.tangents[i].w = -surface.tangents[i].w;
            ++turned;
        }
    return turned;
}

} // namespace

TurnedFaces turn_faces(Surface &surface, std::span<const std::uint8_t> turn) {
    TurnedFaces turned;
    if (!surface.normals.empty())
        turned.normals = turn_normals(surface, turn);
    for (std::size_t i = 0; i < turn.size(); ++i)
        if (turn[i] != 0) {
            reverse_face(surface, i);
            ++turned.faces;
        }
    return turned;
}

} // namespace pbm::build
