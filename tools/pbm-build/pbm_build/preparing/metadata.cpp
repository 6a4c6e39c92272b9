#include "pbm_build/preparing/metadata.h"

#include "pbm_format/container/layout.h"
#include "pbm_scan/conventions/crs.h"
#include "pbm_scan/surface/refusal.h"

#include <nlohmann/json.hpp>

namespace pbm::build {

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
        return usage("--name, --licence and --credit take UTF-8 text only");
    }
    if (text.size() > kMaxMetadataBytes)
        return usage("--name, --licence, --credit and the options of the scene are too long: metadata is at most "
                     "4,096 bytes");
    const std::string &crs = scan.crs;
    if (crs.empty())
        return Metadata{std::move(text)};
    constexpr std::size_t kRecord = 256; // room for the hashes of source_record.h
    for (const std::string &each : {crs, short_crs(crs)}) {
        if (each.empty())
            continue;
        try {
            metadata["crs"] = each;
            std::string with_crs = metadata.dump();
            if (with_crs.size() + kRecord > kMaxMetadataBytes)
                continue;
            return Metadata{std::move(with_crs), true};
        } catch (const nlohmann::json::exception &) { // NOLINT(bugprone-empty-catch): no UTF-8
        }
    }
    return Metadata{std::move(text)};
}

} // namespace pbm::build
