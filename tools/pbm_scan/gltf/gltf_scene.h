// The nodes of a glTF file: which meshes are shown, and where.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (sections 3.5 and 3.7.3)
#pragma once

#include "pbm_scan/gltf/gltf_cameras.h"
#include "pbm_scan/gltf/gltf_document.h"
#include "pbm_scan/surface/surface.h"

#include <glm/mat4x4.hpp>

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace pbm::build {

// A mesh at its place.
struct ShownMesh {
    std::size_t mesh = 0;
    glm::dmat4 to_scene{1};
    std::shared_ptr<const std::vector<double>> weights; // of its morph targets, not more than it has
    std::optional<std::size_t> skin{};                  // its joints move the mesh, and `to_scene` does not
};

class GltfScene {
  public:
    // Reads the default scene, or the first. `report` gets lines for what of the nodes is not shown.
    //
    // errors  bad_input  a node does not exist or is a child of itself; instances that contradict themselves
    //         too_large  more than 2^20 nodes and instances
    static Result<GltfScene> read(GltfDocument &document, std::vector<AttributeReport> &report);

    const std::vector<ShownMesh> &shown() const { return shown_; }
    // The first 1,024: more than metadata hold.
    const std::vector<CameraNode> &cameras() const { return cameras_; }
    // Of nodes with meshes that are shown, each once.
    const std::vector<std::string> &names() const { return names_; }

    // Matrices of the joints of a skin, from the mesh to the scene. Valid until the next call.
    //
    // errors  bad_input  a joint does not exist, or has no inverse bind matrix
    Result<const std::vector<glm::dmat4> *> joints(std::size_t skin);

  private:
    explicit GltfScene(GltfDocument &document) : document_(&document) {}
    Status collect(std::vector<AttributeReport> &report);
    Status show(std::size_t node, const glm::dmat4 &to_scene);
    void note_names(std::size_t node, const glm::dmat4 &to_scene);
    void find_places();
    void report_unshown(std::vector<AttributeReport> &report) const;
    glm::dmat4 matrix_of(const Json &node);

    GltfDocument *document_;
    std::vector<ShownMesh> shown_;
    std::vector<CameraNode> cameras_;
    std::vector<std::string> names_;
    std::set<std::string> known_names_;
    std::map<std::size_t, std::shared_ptr<const std::vector<double>>> weights_; // by node that was shown
    std::vector<bool> has_node_;                                                // [meshes] a node of the scene has it
    std::vector<glm::dmat4> places_;                                            // [nodes] to the scene, on demand
    std::map<std::size_t, std::vector<glm::dmat4>> joints_;                     // by skin
    glm::dmat4 origin_{1};
    std::size_t nodes_and_instances_ = 0, normalised_ = 0, hidden_ = 0, instances_ = 0;
};

} // namespace pbm::build
