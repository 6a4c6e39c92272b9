// Splits those vertices of an OBJ whose faces have different normals or materials there.
#pragma once

#include "pbm_scan/mesh/obj_text.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace pbm::build {

// The first normal and material at a vertex are its own; others belong to copies of the vertex.
class VertexCopies {
  public:
    // `vertices`: their number in the file. The numbers of copies start there.
    VertexCopies(std::size_t vertices, bool has_materials) : vertices_(vertices) {
        if (has_materials)
            materials_.resize(vertices, kNoMaterial);
    }

    // Sets the normal at a corner of the next face.
    void add_normal(std::uint32_t vertex, const glm::vec3 &normal) {
        const float length = glm::length(normal);
        if (vertex >= vertices_ || !(length > 0.0F) || !std::isfinite(length))
            return;
        if (normals_.empty()) {
            normals_.resize(vertices_);
            of_face_.resize(vertices_);
        }
        of_face_[vertex] = normal;
    }

    // Replaces vertices by copies, where necessary, in the triangles of the face with these corners.
    void apply(std::span<const std::uint32_t> corners, std::uint16_t material, std::span<glm::uvec3> triangles) {
        const auto is_known = [this](std::uint32_t vertex) { return vertex < vertices_; };
        if ((normals_.empty() && materials_.empty()) || !std::all_of(corners.begin(), corners.end(), is_known))
            return;
        substitutes_.resize(vertices_);
        last_copies_.resize(vertices_, kNone);
        for (const std::uint32_t vertex : corners) {
            substitutes_[vertex] = vertex_with(vertex, of_face_.empty() ? glm::vec3(0.0F) : of_face_[vertex], material);
        }
        for (glm::uvec3 &t : triangles)
            for (int corner = 0; corner < 3; ++corner)
                t[corner] = substitutes_[t[corner]];
        for (const std::uint32_t vertex : corners)
            if (!of_face_.empty())
                of_face_[vertex] = glm::vec3(0.0F);
    }

    // Attributes of the vertices, then of the copies; empty if the file has none.
    const std::vector<glm::vec3> &normals() const { return normals_; }
    const std::vector<std::uint16_t> &materials() const { return materials_; }
    const std::vector<std::uint32_t> &copies() const { return copies_; } // the vertex of each

  private:
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

    // Whether a vertex or copy has these attributes. One without a normal takes any.
    bool takes(std::size_t i, const glm::vec3 &normal, std::uint16_t material) {
        if (!materials_.empty() && materials_[i] != kNoMaterial && materials_[i] != material)
            return false;
        const glm::vec3 none(0.0F);
        if (!normals_.empty() && normals_[i] != none && normal != none && normals_[i] != normal)
            return false;
        if (!materials_.empty())
            materials_[i] = material;
        if (!normals_.empty() && normals_[i] == none)
            normals_[i] = normal;
        return true;
    }

    std::uint32_t vertex_with(std::uint32_t vertex, const glm::vec3 &normal, std::uint16_t material) {
        constexpr int kMaxCompared = 64; // copies of one vertex: bounds the time at the hub of a fan, may add a copy
        if (takes(vertex, normal, material))
            return vertex;
        int compared = 0;
        for (std::uint32_t i = last_copies_[vertex]; i != kNone && compared < kMaxCompared;
             i = previous_[i], ++compared)
            if (takes(vertices_ + i, normal, material))
                return static_cast<std::uint32_t>(vertices_ + i);
        if (copies_.size() == kMaxVertices)
            return vertex;
        previous_.push_back(last_copies_[vertex]);
        last_copies_[vertex] = static_cast<std::uint32_t>(copies_.size());
        copies_.push_back(vertex);
        if (!normals_.empty())
            normals_.resize(vertices_ + copies_.size());
        if (!materials_.empty())
            materials_.resize(vertices_ + copies_.size(), kNoMaterial);
        const std::size_t copy = vertices_ + copies_.size() - 1;
        takes(copy, normal, material);
        return static_cast<std::uint32_t>(copy);
    }

    std::size_t vertices_;
    std::vector<glm::vec3> normals_, of_face_; // `of_face_`: [vertices] of the corners of the next face
    std::vector<std::uint16_t> materials_;
    std::vector<std::uint32_t> copies_, previous_; // `previous_`: the copy of the same vertex before this one, or kNone
    std::vector<std::uint32_t> last_copies_;       // [vertices] or kNone
    std::vector<std::uint32_t> substitutes_;       // [vertices] in the current face
};

} // namespace pbm::build
