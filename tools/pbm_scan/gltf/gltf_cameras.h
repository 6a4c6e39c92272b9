// Cameras of glTF as views of the scan.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (section 3.10)
#pragma once

#include "pbm_scan/gltf/gltf_document.h"
#include "pbm_scan/surface/surface.h"

#include <glm/mat4x4.hpp>

#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// A node with a camera, which looks along its -z axis.
struct CameraNode {
    std::size_t camera = 0;
    glm::dmat4 to_scene{1};
    std::string name{}; // of the node
};

// The views of these nodes at what lies at `positions`, in their order. Adds a line to `report` if the file has
// cameras.
std::vector<SceneView> views_of(const GltfDocument &document, std::span<const CameraNode> nodes,
                                std::span<const glm::dvec3> positions, std::vector<AttributeReport> &report);

} // namespace pbm::build
