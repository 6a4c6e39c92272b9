// Lights as the user requests them, and their places in the model.
#pragma once

#include "pbm_build/scene/model_frame.h"
#include "pbm_build/scene/option_fields.h"
#include "pbm_format/model/model.h"

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// `from` is a place relative to the centre of the bounding sphere, in its radii: right, up and front as seen by the
// default camera. All other places are in model coordinates.
struct LightRequest {
    LightKind kind = LightKind::directional;
    Vector intensity{1, 1, 1};       // linear
    std::optional<Vector> from;      // any kind; of a directional light only the direction counts
    std::optional<Vector> position;  // point and spot lights without `from`
    std::optional<Vector> direction; // directional lights without `from`, and spot lights; along the light's travel
    std::optional<Vector> target;    // spot lights without direction; default: the centre of the model
    double exponent = 8;             // spot lights
    std::optional<bool> shadows;     // default: the light casts shadows if any are requested
    double size = 0;                 // of soft shadows: the light's diameter over its distance from the centre
    bool operator==(const LightRequest &) const = default;
};

// Parses "directional,direction=0.6,-0.6,-0.5,intensity=1.1": a kind and its keys: from, position, direction, target,
// intensity (one number or three, linear), colour (sRGB, times intensity), exponent, shadows (on, off), size.
//
// errors  usage  an unknown kind or key, one the kind does not have or lacks, a number out of its range, a direction of
//                length zero
Result<LightRequest> read_light(std::string_view text);

// Sets of lights for any model: "two" (the default of the viewers), "studio", "sun", "stage".
std::span<const std::string_view> light_set_names();
std::vector<LightRequest> light_set(std::string_view name); // one of those

Light place(const LightRequest &request, const ModelFrame &frame);

// Empty, or why the light reaches no point of the model.
std::string lights_nothing(const Light &light, const ModelFrame &frame);

} // namespace pbm::build
