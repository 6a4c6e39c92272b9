#include "pbm_scan/gltf/gltf_scene.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace pbm::build {
namespace {

constexpr std::size_t kMaxNodes = std::size_t{1} << 20;

std::string named(const char *array, std::size_t index) {
    return std::string(array) + "[" + std::to_string(index) + "]";
}

// A unit quaternion; true where it was none.
bool normalise(glm::dquat &rotation) {
    constexpr double kTolerance = 1e-6; // of exporters that write numbers of single precision
    const double squared = glm::dot(rotation, rotation);
    if (std::abs(squared - 1) <= kTolerance)
        return false;
    rotation = squared > 0 && std::isfinite(squared) ? rotation / std::sqrt(squared) : glm::dquat(1, 0, 0, 0);
    return true;
}

glm::dmat4 matrix_from(const glm::dvec3 &translation, const glm::dquat &rotation, const glm::dvec3 &scale) {
    glm::dmat4 matrix = glm::mat4_cast(rotation);
    for (int axis = 0; axis < 3; ++axis) {
        matrix[axis] *= scale[axis];
        matrix[3][axis] = translation[axis];
    }
    return matrix;
}

// Without those that no primitive of the mesh has a morph target for, and zeros at the end.
std::shared_ptr<const std::vector<double>> weights_of(const Json *node, const Json *mesh) {
    const Json *const own = member(node, "weights"), *const given = items(own) != 0 ? own : member(mesh, "weights");
    const Json *const primitives = member(mesh, "primitives");
    std::size_t targets = 0, count = 0;
    for (std::size_t i = 0; i < items(primitives) && items(given) != 0; ++i)
        targets = std::max(targets, items(member(item(primitives, i), "targets")));
    for (std::size_t i = 0; i < std::min(items(given), targets); ++i)
        count = number_of(item(given, i), 0) != 0 ? i + 1 : count;
    auto weights = std::make_shared<std::vector<double>>();
    for (std::size_t i = 0; i < count; ++i)
        weights->push_back(number_of(item(given, i), 0));
    return weights;
}

Error too_many_nodes() { return too_large("more than " + std::to_string(kMaxNodes) + " nodes to show; export fewer"); }

} // namespace

glm::dmat4 GltfScene::matrix_of(const Json &node) {
    if (const Json *const given = member(&node, "matrix")) {
        glm::dmat4 matrix(1);
        for (std::size_t i = 0; i < 16; ++i) {
            const auto column = static_cast<int>(i / 4), row = static_cast<int>(i % 4);
            matrix[column][row] = number_of(item(given, i), column == row ? 1 : 0);
        }
        return matrix;
    }
    const Json *const moved = member(&node, "translation"), *const turned = member(&node, "rotation"),
                      *const scaled = member(&node, "scale");
    glm::dquat rotation(number_of(item(turned, 3), 1), number_of(item(turned, 0), 0), number_of(item(turned, 1), 0),
                        number_of(item(turned, 2), 0));
    normalised_ += normalise(rotation) ? 1U : 0U;
    glm::dvec3 translation(0), scale(1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        translation[static_cast<int>(axis)] = number_of(item(moved, axis), 0);
        scale[static_cast<int>(axis)] = number_of(item(scaled, axis), 1);
    }
    return matrix_from(translation, rotation, scale);
}

// Adds the mesh of a node, or its instances (EXT_mesh_gpu_instancing).
Status GltfScene::show(std::size_t number, const glm::dmat4 &to_scene) {
    const Json &node = *item(document_->root("nodes"), number);
    const auto mesh = index_of(&node, "mesh");
    if (!mesh)
        return {};
    auto &weights = weights_[number];
    if (weights == nullptr)
        weights = weights_of(&node, item(document_->root("meshes"), *mesh));
    ShownMesh shown{*mesh, to_scene, weights, index_of(&node, "skin")};
    const Json *const instancing = member(member(&node, "extensions"), "EXT_mesh_gpu_instancing");
    const Json *const attributes = member(instancing, "attributes");
    constexpr std::array<const char *, 3> kNames{"TRANSLATION", "ROTATION", "SCALE"};
    constexpr std::array<std::size_t, 3> kComponents{3, 4, 3};
    std::array<std::vector<float>, 3> values;
    std::optional<std::size_t> count;
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        const auto accessor = index_of(attributes, kNames[i]);
        if (!accessor)
            continue;
        if (document_->count(*accessor) > kMaxNodes - nodes_and_instances_)
            return too_many_nodes();
        auto read = document_->floats(*accessor, kComponents[i]);
        if (!read)
            return read.error();
        if (count && *count != read->size() / kComponents[i])
            return bad_input(std::string(kNames[i]) + " of instances are not as many as others");
        count = read->size() / kComponents[i];
        values[i] = std::move(*read);
    }
    if (!count) {
        shown_.push_back(std::move(shown));
        return {};
    }
    const auto three = [](const std::vector<float> &from, std::size_t i, double otherwise) {
        return from.empty() ? glm::dvec3(otherwise) : glm::dvec3(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    nodes_and_instances_ += *count;
    instances_ += *count;
    for (std::size_t i = 0; i < *count; ++i) {
        glm::dquat rotation(1, 0, 0, 0);
        if (!values[1].empty()) {
            const float *const q = &values[1][4 * i];
            rotation = glm::dquat(q[3], q[0], q[1], q[2]);
            normalise(rotation);
        }
        shown.to_scene = to_scene * matrix_from(three(values[0], i, 0), rotation, three(values[2], i, 1));
        shown_.push_back(shown);
    }
    return {};
}

// The camera of a node, or the name of one with a mesh.
void GltfScene::note_names(std::size_t number, const glm::dmat4 &to_scene) {
    constexpr std::size_t kMaxCameras = 1024;
    const Json *const node = item(document_->root("nodes"), number);
    if (const auto camera = index_of(node, "camera"); camera && cameras_.size() < kMaxCameras)
        cameras_.push_back({*camera, to_scene, text_of(node, "name")});
    if (member(node, "mesh") == nullptr || weights_.contains(number)) // the node is shown once more
        return;
    std::string name = text_of(node, "name");
    if (!name.empty() && known_names_.insert(name).second)
        names_.push_back(std::move(name));
}

Status GltfScene::collect(std::vector<AttributeReport> &report) {
    const Json *const nodes = document_->root("nodes"), *const scenes = document_->root("scenes");
    const std::size_t meshes = items(document_->root("meshes"));
    const std::size_t scene = index_of(document_->root("scene")).value_or(0);
    const Json *const roots = member(item(scenes, scene), "nodes");
    struct Visit {
        std::size_t node;
        glm::dmat4 to_scene;
        std::size_t depth;
        bool is_hidden;
    };
    // CESIUM_RTC: the place of all coordinates
    if (const Json *const centre = member(member(document_->root("extensions"), "CESIUM_RTC"), "center"))
        for (std::size_t axis = 0; axis < 3; ++axis)
            origin_[3][static_cast<int>(axis)] = number_of(item(centre, axis), 0);
    if (roots == nullptr && items(scenes) == 0) {
        for (std::size_t mesh = 0; mesh < meshes; ++mesh) // a library of meshes
            shown_.push_back({mesh, origin_, weights_of(nullptr, item(document_->root("meshes"), mesh)), {}});
        return {};
    }
    has_node_.resize(meshes);
    std::vector<Visit> left;
    const auto add = [&](const Json *list, const Visit &parent) {
        if (items(list) > kMaxNodes - std::min(kMaxNodes, nodes_and_instances_ + left.size()))
            return false;
        for (std::size_t i = items(list); i-- > 0;)
            if (const auto node = index_of(item(list, i)))
                left.push_back({*node, parent.to_scene, parent.depth + 1, parent.is_hidden});
        return true;
    };
    if (!add(roots, {0, origin_, 0, false}))
        return too_many_nodes();
    while (!left.empty()) {
        Visit visit = left.back();
        left.pop_back();
        const Json *const node = item(nodes, visit.node);
        if (node == nullptr)
            return bad_input(named("nodes", visit.node) + " does not exist");
        if (visit.depth > items(nodes) + 1)
            return bad_input(named("nodes", visit.node) + " is a child of itself; export the scan again");
        if (++nodes_and_instances_ > kMaxNodes)
            return too_many_nodes();
        visit.to_scene = visit.to_scene * matrix_of(*node);
        const Json *const visible = member(member(member(node, "extensions"), "KHR_node_visibility"), "visible");
        if (visible != nullptr && visible->is_boolean() && !visible->get<bool>())
            visit.is_hidden = true;
        if (const auto mesh = index_of(node, "mesh"); mesh && *mesh < meshes)
            has_node_[*mesh] = true;
        hidden_ += visit.is_hidden && member(node, "mesh") != nullptr ? 1U : 0U;
        if (!visit.is_hidden) {
            note_names(visit.node, visit.to_scene);
            if (Status shown = show(visit.node, visit.to_scene); !shown)
                return shown;
        }
        if (!add(member(node, "children"), visit))
            return too_many_nodes();
    }
    report_unshown(report);
    return {};
}

void GltfScene::report_unshown(std::vector<AttributeReport> &report) const {
    const Json *const scenes = document_->root("scenes");
    const std::size_t shown = index_of(document_->root("scene")).value_or(0);
    const auto name_of = [&](std::size_t scene) {
        const std::string name = text_of(item(scenes, scene), "name");
        return name.empty() ? named("scenes", scene) : printable_in_quotes(name);
    };
    std::vector<std::string> others, meshes;
    for (std::size_t i = 0; i < items(scenes); ++i)
        if (i != shown)
            others.push_back(name_of(i));
    if (!others.empty())
        report.push_back({"scenes " + listed(others), Fate::dropped, "the default scene is " + name_of(shown)});
    for (std::size_t i = 0; i < has_node_.size(); ++i)
        if (!has_node_[i])
            meshes.push_back(std::to_string(i));
    if (!meshes.empty())
        report.push_back({"meshes " + listed(meshes), Fate::dropped, "no node of the scene shows them"});
    if (hidden_ != 0)
        report.push_back({"hidden nodes", Fate::kept, counted(hidden_, "mesh") + " left out (KHR_node_visibility)"});
    if (instances_ != 0)
        report.push_back({"instances", Fate::kept, std::to_string(instances_) + " (EXT_mesh_gpu_instancing)"});
    if (normalised_ != 0)
        report.push_back({"rotations", Fate::converted, std::to_string(normalised_) + " to quaternions of length 1"});
}

Result<GltfScene> GltfScene::read(GltfDocument &document, std::vector<AttributeReport> &report) {
    GltfScene scene(document);
    if (Status collected = scene.collect(report); !collected)
        return collected.error();
    return scene;
}

// The places of all nodes, from those without parents downwards: joints may lie outside of the scene.
void GltfScene::find_places() {
    const Json *const nodes = document_->root("nodes");
    std::vector<bool> is_child(items(nodes)), is_placed(items(nodes));
    const auto for_children = [&](std::size_t node, const auto &visit) {
        const Json *const children = member(item(nodes, node), "children");
        for (std::size_t i = 0; i < items(children); ++i)
            if (const auto child = index_of(item(children, i)); child && *child < is_child.size())
                visit(*child);
    };
    for (std::size_t i = 0; i < is_child.size(); ++i)
        for_children(i, [&](std::size_t child) { is_child[child] = true; });
    places_.resize(is_child.size(), origin_);
    std::vector<std::size_t> left;
    for (std::size_t i = 0; i < is_child.size(); ++i)
        if (!is_child[i])
            left.push_back(i);
    for (const std::size_t root : left) {
        places_[root] = origin_ * matrix_of(*item(nodes, root));
        is_placed[root] = true;
    }
    while (!left.empty()) {
        const std::size_t node = left.back();
        left.pop_back();
        for_children(node, [&](std::size_t child) {
            if (is_placed[child])
                return;
            is_placed[child] = true;
            places_[child] = places_[node] * matrix_of(*item(nodes, child));
            left.push_back(child);
        });
    }
}

Result<const std::vector<glm::dmat4> *> GltfScene::joints(std::size_t skin) {
    if (const auto known = joints_.find(skin); known != joints_.end())
        return &known->second;
    if (places_.empty())
        find_places();
    const std::string name = named("skins", skin);
    const Json *const described = item(document_->root("skins"), skin), *const joints = member(described, "joints");
    if (items(joints) == 0)
        return bad_input(name + " does not exist or has no joints");
    std::vector<float> inverses;
    if (const auto accessor = index_of(described, "inverseBindMatrices")) {
        auto read = document_->floats(*accessor, 16);
        if (!read)
            return read.error();
        inverses = std::move(*read);
        if (inverses.size() / 16 < items(joints))
            return bad_input(name + " has fewer inverse bind matrices than joints");
    }
    std::vector<glm::dmat4> matrices;
    for (std::size_t i = 0; i < items(joints); ++i) {
        const auto joint = index_of(item(joints, i));
        if (!joint || *joint >= places_.size())
            return bad_input(name + ": a joint is no node of this file");
        glm::dmat4 inverse(1);
        for (std::size_t k = 0; k < 16 && !inverses.empty(); ++k)
            inverse[static_cast<int>(k / 4)][static_cast<int>(k % 4)] = static_cast<double>(inverses[16 * i + k]);
        matrices.push_back(places_[*joint] * inverse);
    }
    return &joints_.emplace(skin, std::move(matrices)).first->second;
}

} // namespace pbm::build
