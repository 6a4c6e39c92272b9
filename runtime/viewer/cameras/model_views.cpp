#include "viewer/cameras/model_views.h"

#include "command_line/common_options.h"
#include "pbm_format/container/layout.h"

#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace pbm {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr const char *kView = "view", *kViews = "views", *kOrthographic = "orthographic";

std::string text_at(const OrderedJson &object, const char *key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::optional<glm::dvec3> vector_at(const OrderedJson &object, const char *key) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_array() || found->size() != 3 ||
        !std::all_of(found->begin(), found->end(), [](const OrderedJson &item) { return item.is_number(); }))
        return std::nullopt;
    return glm::dvec3((*found)[0].get<double>(), (*found)[1].get<double>(), (*found)[2].get<double>());
}

OrderedJson list_of(const glm::dvec3 &v) { return OrderedJson::array({v.x, v.y, v.z}); }

std::optional<SavedView> view_of(const OrderedJson &json) {
    if (!json.is_object())
        return std::nullopt;
    const auto position = vector_at(json, "position"), focal_point = vector_at(json, "focal_point"),
               up = vector_at(json, "up");
    const auto angle = json.find("angle");
    if (!position || !focal_point || !up || angle == json.end() || !angle->is_number())
        return std::nullopt;
    const SavedView view{{.position = *position,
                          .focal_point = *focal_point,
                          .up = *up,
                          .view_angle = glm::radians(angle->get<double>()),
                          .orthographic = text_at(json, "projection") == kOrthographic},
                         angle->get<double>()};
    return is_usable(view.camera) ? std::optional(view) : std::nullopt;
}

// The value of a key of the metadata; null: there is none.
OrderedJson member_of(std::string_view metadata, const char *key) {
    const OrderedJson json = OrderedJson::parse(metadata, nullptr, false);
    return json.is_object() && json.contains(key) ? json[key] : OrderedJson();
}

} // namespace

std::optional<SavedView> start_view(std::string_view metadata) { return view_of(member_of(metadata, kView)); }

std::vector<NamedView> named_views(std::string_view metadata) {
    std::vector<NamedView> views;
    const OrderedJson list = member_of(metadata, kViews);
    if (!list.is_array())
        return views;
    for (const OrderedJson &json : list)
        if (const auto view = view_of(json))
            if (std::string name = text_at(json, "name"); !name.empty())
                views.push_back({std::move(name), *view});
    return views;
}

Result<SavedView> find_view(std::string_view metadata, const std::string &name) {
    const std::vector<NamedView> views = named_views(metadata);
    const auto found = std::find_if(views.begin(), views.end(), [&](const NamedView &v) { return v.name == name; });
    if (found != views.end())
        return found->view;
    constexpr std::size_t kShown = 8;
    std::string names;
    for (std::size_t i = 0; i < views.size() && i < kShown; ++i)
        names += (i == 0 ? "" : ", ") + command_line::printable(views[i].name);
    return usage_error("--view: " + (views.empty()
                                         ? "the model has no view with a name; build it from a glTF file with cameras"
                                         : "no view is named " + command_line::printable(name) +
                                               "; there are: " + names + (views.size() > kShown ? ", ..." : "")));
}

ViewOptions with_camera(ViewOptions options, const SavedView &view) {
    options.position = view.camera.position;
    options.focal_point = view.camera.focal_point;
    options.view_up = view.camera.up;
    options.view_angle = view.view_angle;
    options.orthographic = view.camera.orthographic;
    return options;
}

Result<std::string> with_start_view(std::string_view metadata, const SavedView &view) {
    OrderedJson json = OrderedJson::parse(metadata, nullptr, false);
    if (!json.is_object())
        json = OrderedJson::object();
    json[kView] = {{"position", list_of(view.camera.position)},
                   {"focal_point", list_of(view.camera.focal_point)},
                   {"up", list_of(view.camera.up)},
                   {"angle", view.view_angle}};
    if (view.camera.orthographic)
        json[kView]["projection"] = kOrthographic;
    std::string text = json.dump();
    if (text.size() > kMaxMetadataBytes)
        return Error{ErrorCode::too_large, 0, "the metadata has no room for the view: it is at most 4,096 bytes"};
    return text;
}

} // namespace pbm
