#include "pbm_scan/ply/ply_colours.h"

#include "pbm_scan/clouds/splat_colour.h"
#include "pbm_scan/text/text_number.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pbm::build {
namespace {

// Factor from the file's colours to 0..255; zero if the numbers are no colours. Floats in 0..255 and ushorts within a
// byte are common.
float colour_factor(PlyScalar type, float highest) {
    constexpr float kOvershoot = 2.0F;
    if (is_float(type) && highest <= kOvershoot)
        return 255.0F;
    if (highest <= 255.0F)
        return 1.0F;
    return highest <= 65535.0F ? 255.0F / 65535.0F : 0.0F;
}

// `wide`: colours of vertices, or means over their faces.
PlyOutcome convert_colours(PlyScalar type, std::vector<glm::vec3> &wide, Surface &surface) {
    float highest = 0;
    std::size_t strange = 0;
    for (glm::vec3 &colour : wide) {
        bool in_range = true;
        for (int i = 0; i < 3; ++i) {
            if (type == PlyScalar::int8 && colour[i] < 0)
                colour[i] += 256; // a byte that was declared with a sign
            if (std::isfinite(colour[i]))
                highest = std::max(highest, colour[i]);
            in_range = in_range && std::isfinite(colour[i]) && colour[i] >= 0;
        }
        strange += in_range ? 0U : 1U;
    }
    const float factor = colour_factor(type, highest);
    if (factor == 0.0F)
        return {Fate::dropped, "values up to " + number_text(static_cast<double>(highest)) + " are no colours"};
    surface.colours.reserve(wide.size());
    for (const glm::vec3 &colour : wide)
        surface.colours.push_back(colour_bytes(colour, factor));
    const char *range = factor == 1.0F ? "0..255" : factor == 255.0F ? "0..1" : "0..65535";
    std::string note = std::string(to_string(type)) + " in " + range + " to sRGB of 8 bits";
    if (strange > 0)
        note += "; " + std::to_string(strange) + " of them negative or not finite, which is 0 or 255";
    return {Fate::converted, note};
}

PlyOutcome convert_splat_colours(const std::vector<glm::vec3> &coefficients, Surface &surface) {
    surface.colours.reserve(coefficients.size());
    for (const glm::vec3 &c : coefficients)
        surface.colours.push_back(splat_colour(c));
    return {Fate::converted, kSplatColourNote};
}

} // namespace

PlyOutcome finish_colours(const PlyRoles &roles, PlyBody &body, Surface &surface) {
    surface.colours = std::move(body.colours);
    if (body.wide_colours.empty())
        return {Fate::kept, "sRGB, 8 bits"};
    if (roles.splat_colours)
        return convert_splat_colours(body.wide_colours, surface);
    PlyScalar type = PlyScalar::int8; // the widest of the three
    for (const PlyProperty *channel : roles.colour)
        type = std::max(type, channel->type);
    return convert_colours(type, body.wide_colours, surface);
}

PlyOutcome finish_face_colours(const PlyRoles &roles, PlyBody &body, Surface &surface) {
    MeanColours means = mean_colours(body.face_colours, "a face");
    if (means.without == means.colours.size())
        return {Fate::dropped, "no vertex belongs to a face"};
    PlyOutcome outcome = convert_colours(roles.face_colour[0]->type, means.colours, surface);
    if (outcome.fate != Fate::dropped)
        outcome.note = means.note;
    return outcome;
}

} // namespace pbm::build
