#include "pbm_scan/gltf/gltf_cameras.h"

#include "pbm_scan/text/text_lines.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <optional>

namespace pbm::build {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kFlatAngle = kPi / 6; // of orthographic cameras, as pbm-render --camera-file has them

glm::dvec3 middle_of(std::span<const glm::dvec3> positions) {
    glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
    for (const glm::dvec3 &p : positions)
        if (is_finite(p)) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
    return low / 2.0 + high / 2.0;
}

// What the camera looks at lies in front of it: as far away as `middle`, or, of an orthographic one, where its angle
// spans its height. Nothing: the camera makes no sense.
std::optional<SceneView> view_of(const Json *camera, const CameraNode &node, const glm::dvec3 &middle) {
    SceneView view{.name = node.name, .position = glm::dvec3(node.to_scene[3])};
    if (view.name.empty())
        view.name = text_of(camera, "name");
    const glm::dvec3 forward = glm::normalize(-glm::dvec3(node.to_scene[2]));
    view.up = glm::normalize(glm::dvec3(node.to_scene[1]));
    view.is_orthographic = text_of(camera, "type") == "orthographic";
    view.view_angle = view.is_orthographic ? kFlatAngle : number_of(member(camera, "perspective"), "yfov", 0);
    double distance = glm::dot(middle - view.position, forward);
    if (!(distance > 0))
        distance = glm::distance(middle, view.position);
    if (view.is_orthographic)
        distance = number_of(member(camera, "orthographic"), "ymag", 0) / std::tan(kFlatAngle / 2);
    view.focal_point = view.position + distance * forward;
    const bool is_good = is_finite(view.position) && is_finite(view.focal_point) && is_finite(view.up) &&
                         distance > 0 && glm::length(glm::cross(forward, view.up)) > 1e-6 && view.view_angle > 1e-3 &&
                         view.view_angle < kPi - 1e-3;
    return is_good ? std::optional(view) : std::nullopt;
}

} // namespace

std::vector<SceneView> views_of(const GltfDocument &document, std::span<const CameraNode> nodes,
                                std::span<const glm::dvec3> positions, std::vector<AttributeReport> &report) {
    const Json *const cameras = document.root("cameras");
    std::vector<SceneView> views;
    if (items(cameras) == 0)
        return views;
    const glm::dvec3 middle = middle_of(positions);
    for (const CameraNode &node : nodes)
        if (const auto view = view_of(item(cameras, node.camera), node, middle))
            views.push_back(*view);
    if (!views.empty())
        report.push_back({"cameras", Fate::kept, counted(views.size(), "view") + " of the metadata"});
    if (nodes.empty())
        drop_once(report, "cameras", "no node of the scene has one");
    else if (views.size() < nodes.size())
        drop_once(report, "damaged cameras", counted(nodes.size() - views.size(), "camera") + " without sense");
    return views;
}

} // namespace pbm::build
