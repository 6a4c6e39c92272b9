#include "pbm_build/scene/metadata.h"

#include "pbm_format/container/layout.h"

#include <nlohmann/json.hpp>

namespace pbm::build {

Result<std::string> make_metadata(const BuildRecord &record) {
    const auto &[credits, grid, placement, points, colour, coding, flip_faces, scene] = record;
    nlohmann::ordered_json metadata;
    metadata["generator"] = std::string("pbm-build ") + PBM_VERSION;
    const auto add = [&](const char *key, const std::string &text) {
        if (!text.empty())
            metadata[key] = text;
    };
    add("name", credits.name);
    add("licence", credits.licence);
    add("credit", credits.credit);
    nlohmann::ordered_json &options = metadata["options"];
    if (grid.depth)
        options["depth"] = *grid.depth;
    if (grid.voxel_size)
        options["voxel_size"] = *grid.voxel_size;
    if (grid.max_points)
        options["max_points"] = *grid.max_points;
    if (grid.like)
        options["grid_like"] = true;
    if (placement.scale)
        options["scale"] = *placement.scale;
    if (placement.origin)
        options["origin"] = *placement.origin;
    if (colour != ColourFormat::none)
        options["colour"] = colour == ColourFormat::rgb565 ? 565 : 888;
    if (coding.storage == Storage::mapped)
        options["store"] = "mapped";
    else
        options["compression_level"] = coding.compression_level;
    if (flip_faces)
        options["flip_faces"] = true;
    if (points.viewpoint)
        options["viewpoint"] = *points.viewpoint;
    if (points.remove_outliers)
        options["remove_outliers"] = true;
    for (const GivenOption &given : scene) {
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
        return Error{ErrorCode::usage, 0, "--name, --licence and --credit take UTF-8 text only"};
    }
    if (text.size() > kMaxMetadataBytes)
        return Error{ErrorCode::usage, 0,
                     "--name, --licence, --credit and the options of the scene are too long: metadata is at most "
                     "4,096 bytes"};
    return text;
}

} // namespace pbm::build
