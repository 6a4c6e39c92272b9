#include "pbm_build/surface/corner_tangents.h"

#include "pbm_build/surface/face_normal.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096;

glm::dvec3 vector_of(const ShortNormal &n) { return glm::dvec3(n[0], n[1], n[2]) / kNormalScale; }

// What a face says of one of its corners.
struct CornerTangent {
    std::array<std::int64_t, 3> sum{}; // direction x angle, in steps of 2^-20; zero: none
    bool is_mirrored = false;
};

class TangentSpace {
  public:
    TangentSpace(const Surface &surface, std::span<const ShortNormal> normals, bool faces_point_inward)
        : surface_(surface), places_(surface.layer(Layer::normals).corners), normals_(normals),
          faces_point_inward_(faces_point_inward) {}

    CornerTangent tangent(std::size_t triangle, std::size_t corner) const {
        const std::size_t b = (corner + 1) % 3, c = (corner + 2) % 3;
        const glm::dvec3 to_b = at(triangle, b) - at(triangle, corner), to_c = at(triangle, c) - at(triangle, corner);
        const glm::dvec2 in_b = place(triangle, b) - place(triangle, corner),
                         in_c = place(triangle, c) - place(triangle, corner);
        const double area = in_b.x * in_c.y - in_c.x * in_b.y;
        const glm::dvec3 right = std::copysign(1.0, area) * (in_c.y * to_b - in_b.y * to_c),
                         up = std::copysign(1.0, area) * (in_b.x * to_c - in_c.x * to_b);
        const glm::dvec3 normal = vector_of(normal_at(triangle, corner));
        const auto in_plane = [&normal](const glm::dvec3 &v) {
            const glm::dvec3 flat = v - glm::dot(v, normal) * normal;
            const double length = glm::length(flat);
            return length > 0 && std::isfinite(length) ? flat / length : glm::dvec3(0);
        };
        const glm::dvec3 along = in_plane(right);
        const double angle = std::acos(std::clamp(glm::dot(in_plane(to_b), in_plane(to_c)), -1.0, 1.0));
        CornerTangent made{.sum = {}, .is_mirrored = glm::dot(glm::cross(normal, along), up) < 0};
        for (int axis = 0; axis < 3 && area != 0; ++axis)
            made.sum[static_cast<std::size_t>(axis)] = std::llround(along[axis] * angle * 0x1p20);
        return made;
    }

    // Equal for corners that share a tangent, and hardly ever for others.
    std::uint64_t key(std::size_t triangle, std::size_t corner, bool is_mirrored) const {
        std::uint64_t hash = is_mirrored ? 1 : 0;
        const auto add = [&hash](auto bits) {
            hash = (hash ^ bits) * 0x9E3779B97F4A7C15U;
            hash ^= hash >> 29;
        };
        for (int axis = 0; axis < 3; ++axis)
            add(std::bit_cast<std::uint64_t>(at(triangle, corner)[axis]));
        for (const std::int16_t number : normal_at(triangle, corner))
            add(static_cast<std::uint64_t>(static_cast<std::uint16_t>(number)));
        for (int axis = 0; axis < 2; ++axis)
            add(std::uint64_t{std::bit_cast<std::uint32_t>(places_[triangle][corner][axis])});
        return hash;
    }

    bool has_image(std::size_t triangle) const {
        return surface_.layer(Layer::normals).ids[triangle] != Surface::kNoTexture;
    }
    // Whether the file gives the tangents of all corners; takes them.
    bool take_given(std::size_t triangle, TriangleTangents &to) const {
        if (surface_.tangents.empty())
            return false;
        TriangleTangents given;
        double senses = 0;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const glm::vec4 &tangent = surface_.tangents[vertex(triangle, corner)];
            given.along[corner] = to_short_normal(glm::dvec3(tangent));
            senses += static_cast<double>(tangent.w);
            if (is_zero(given.along[corner]))
                return false;
        }
        given.is_mirrored = senses < 0;
        to = given;
        return true;
    }

  private:
    std::uint32_t vertex(std::size_t triangle, std::size_t corner) const {
        return surface_.triangles[triangle][static_cast<int>(corner)];
    }
    const glm::dvec3 &at(std::size_t triangle, std::size_t corner) const {
        return surface_.positions[vertex(triangle, corner)];
    }
    // y upwards.
    glm::dvec2 place(std::size_t triangle, std::size_t corner) const {
        const glm::vec2 &place = places_[triangle][corner];
        return {place.x, -static_cast<double>(place.y)};
    }
    ShortNormal normal_at(std::size_t triangle, std::size_t corner) const {
        const ShortNormal &given = normals_[vertex(triangle, corner)];
        if (!is_zero(given))
            return given;
        const glm::dvec3 facing = face_normal(at(triangle, 0), at(triangle, 1), at(triangle, 2));
        return to_short_normal(faces_point_inward_ ? -facing : facing);
    }

    const Surface &surface_;
    const std::vector<TextureCorners> &places_;
    std::span<const ShortNormal> normals_;
    bool faces_point_inward_;
};

using KeyOfCorner = std::pair<std::uint64_t, std::uint64_t>; // and 3 x triangle + corner

// Corners whose tangents are to be computed, those of one key together.
std::vector<KeyOfCorner> corners_by_key(const TangentSpace &space, std::vector<TriangleTangents> &tangents,
                                        int threads) {
    constexpr std::uint64_t kNone = ~std::uint64_t{0};
    std::vector<KeyOfCorner> corners(3 * tangents.size(), {0, kNone});
    parallel_for(tangents.size(), kBlock, threads, [&](std::size_t triangle) {
        if (!space.has_image(triangle) || space.take_given(triangle, tangents[triangle]))
            return;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const CornerTangent own = space.tangent(triangle, corner);
            tangents[triangle].is_mirrored = own.is_mirrored;
            if (own.sum != CornerTangent{}.sum)
                corners[3 * triangle + corner] = {space.key(triangle, corner, own.is_mirrored), 3 * triangle + corner};
        }
    });
    std::erase_if(corners, [](const KeyOfCorner &corner) { return corner.second == kNone; });
    std::sort(corners.begin(), corners.end());
    return corners;
}

} // namespace

std::vector<TriangleTangents> corner_tangents(const Surface &surface, std::span<const ShortNormal> normals,
                                              bool faces_point_inward, int threads) {
    if (surface.layer(Layer::normals).ids.empty())
        return {};
    const TangentSpace space(surface, normals, faces_point_inward);
    std::vector<TriangleTangents> tangents(surface.triangles.size());
    const std::vector<KeyOfCorner> corners = corners_by_key(space, tangents, threads);
    for (auto begin = corners.begin(); begin != corners.end();) {
        const auto end =
            std::find_if(begin, corners.end(), [&](const KeyOfCorner &corner) { return corner.first != begin->first; });
        glm::dvec3 sum(0);
        for (auto corner = begin; corner != end; ++corner) // of integers below 2^22: exact
            for (int axis = 0; axis < 3; ++axis)
                sum[axis] += static_cast<double>(
                    space.tangent(corner->second / 3, corner->second % 3).sum[static_cast<std::size_t>(axis)]);
        for (auto corner = begin; corner != end; ++corner)
            tangents[corner->second / 3].along[corner->second % 3] = to_short_normal(sum);
        begin = end;
    }
    return tangents;
}

} // namespace pbm::build
