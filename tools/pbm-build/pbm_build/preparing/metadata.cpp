#include "pbm_build/preparing/metadata.h"

#include "pbm_format/container/layout.h"
#include "pbm_scan/conventions/crs.h"
#include "pbm_scan/surface/refusal.h"

#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace pbm::build {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kRecord = 256;    // bytes for the hashes of source_record.h
constexpr std::size_t kStartView = 384; // bytes for the view that a window saves

// Adds a value that is not empty to the metadata if `room` bytes stay free, and updates its text. False, and nothing
// changed: there is no room, or the value is no UTF-8.
bool add_if_fits(Json &metadata, const char *key, Json value, std::size_t room, std::string &text) {
    Json with = metadata;
    with[key] = std::move(value);
    try {
        std::string longer = with.dump();
        if (with[key].empty() || with[key] == "" || longer.size() + room > kMaxMetadataBytes)
            return false;
        text = std::move(longer);
    } catch (const nlohmann::json::exception &) {
        return false;
    }
    metadata = std::move(with);
    return true;
}

// A number with twelve digits: with fewer, places of projected coordinates lose millimetres.
double rounded(double number) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.12g", number);
    return std::strtod(text.data(), nullptr);
}

Json as_json(const SceneView &view) {
    const auto vector = [](const glm::dvec3 &v) { return Json{rounded(v.x), rounded(v.y), rounded(v.z)}; };
    Json json;
    if (!view.name.empty())
        json["name"] = view.name;
    json["position"] = vector(view.position);
    json["focal_point"] = vector(view.focal_point);
    json["up"] = vector(view.up);
    json["angle"] = rounded(glm::degrees(view.view_angle));
    if (view.is_orthographic)
        json["projection"] = "orthographic";
    return json;
}

} // namespace

Result<Metadata> make_metadata(const BuildOptions &build, const ScanFacts &scan) {
    const GridRequest &grid = build.grid;
    const Placement &placement = build.placement;
    nlohmann::ordered_json metadata;
    metadata["generator"] = std::string("pbm-build ") + PBM_VERSION;
    const auto add = [&](const char *key, const std::string &text) {
        if (!text.empty())
            metadata[key] = text;
    };
    add("name", build.credits.name);
    add("licence", build.credits.licence);
    add("credit", build.credits.credit);
    if (scan.is_uncoloured_cloud && build.scene.given.empty())
        metadata["uncoloured_cloud"] = true;
    nlohmann::ordered_json &options = metadata["options"];
    const auto give = [&](const char *key, const auto &value) {
        if (value)
            options[key] = *value;
    };
    const auto set = [&](const char *key, bool is_set) { give(key, is_set ? &is_set : nullptr); };
    give("depth", grid.depth);
    give("voxel_size", grid.voxel_size);
    give("max_points", grid.max_points);
    set("grid_like", grid.like.has_value());
    give("scale", placement.scale);
    give("origin", placement.origin);
    if (scan.colour != ColourFormat::none)
        options["colour"] = scan.colour == ColourFormat::rgb565 ? 565 : 888;
    if (build.storage == Storage::mapped)
        options["store"] = "mapped";
    else
        options["compression_level"] = build.compression_level;
    set("orient_faces", build.mesh.winding.requested);
    set("no_orient_faces", build.mesh.winding.keep);
    set("flip_faces", build.mesh.winding.flip);
    if (build.mesh.smallest_part)
        options["drop_parts"] = to_text(*build.mesh.smallest_part);
    give("fill_holes", build.mesh.max_hole_edges);
    give("crease_angle", build.crease_angle);
    give("alpha_cutoff", build.alpha_cutoff);
    set("flip_green", build.flip_green);
    if (build.viewpoints.size() == 1)
        options["viewpoint"] = build.viewpoints.front();
    else if (!build.viewpoints.empty())
        options["viewpoint"] = build.viewpoints;
    set("remove_outliers", build.outliers == Outliers::drop);
    set("geographic", build.is_geographic);
    set("keep_placeholders", build.keep_placeholders);
    if (build.min_opacity != BuildOptions().min_opacity)
        options["min_opacity"] = build.min_opacity;
    set("keep_outliers", build.outliers == Outliers::keep);
    give("upsample", build.upsample);
    if (!build.dropped_fields.empty())
        options["drop_field"] = build.dropped_fields;
    for (const GivenOption &given : build.scene.given) {
        nlohmann::ordered_json &value = options[given.name];
        if (value.is_null())
            value = given.value == "true" ? nlohmann::ordered_json(true) : nlohmann::ordered_json(given.value);
        else if (value.is_array())
            value.push_back(given.value);
        else
            value = {value, given.value};
    }

    std::string text;
    try {
        text = metadata.dump();
    } catch (const nlohmann::json::exception &) {
        return usage_error("--name, --licence and --credit take UTF-8 text only");
    }
    if (text.size() > kMaxMetadataBytes)
        return usage_error("--name, --licence, --credit and the options of the scene are too long: metadata is at most "
                           "4,096 bytes");
    Metadata made{std::move(text)};
    made.has_crs = !scan.crs.empty() && (add_if_fits(metadata, "crs", scan.crs, kRecord, made.text) ||
                                         add_if_fits(metadata, "crs", short_crs(scan.crs), kRecord, made.text));
    nlohmann::ordered_json views = nlohmann::ordered_json::array(), names = views;
    for (const SceneView &view : scan.views) {
        views.push_back(as_json(view));
        if (!add_if_fits(metadata, "views", views, kRecord + kStartView, made.text))
            break;
        ++made.views;
    }
    for (const std::string &name : scan.part_names) {
        names.push_back(name);
        if (!add_if_fits(metadata, "parts", names, kRecord + kStartView, made.text))
            break;
        ++made.part_names;
    }
    return made;
}

} // namespace pbm::build
