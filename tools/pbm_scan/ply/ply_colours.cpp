#include "pbm_scan/ply/ply_colours.h"

#include "pbm_scan/clouds/gaussian_splats.h"
#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/text/text_number.h"

#include <algorithm>
#include <vector>

namespace pbm::build {
namespace {

// `wide`: colours of vertices, or means over their faces.
PlyOutcome convert_colours(PlyScalar type, std::vector<glm::vec3> &wide, Surface &surface) {
    std::size_t not_finite = 0;
    for (glm::vec3 &colour : wide) {
        for (int i = 0; i < 3 && type == PlyScalar::int8; ++i)
            if (colour[i] < 0)
                colour[i] += 256; // a byte that was declared with a sign
        not_finite += is_finite(glm::dvec3(colour)) ? 0U : 1U;
    }
    const ColourRange range = colour_range(wide, is_float(type) ? ColourNumbers::any : ColourNumbers::whole);
    if (range.white == 0)
        return {Fate::dropped, "nearly all are above 65,535: these are no colours"};
    surface.colours.reserve(wide.size());
    for (const glm::vec3 &colour : wide)
        surface.colours.push_back(colour_bytes(colour, range.factor()));
    std::string note =
        std::string(to_string(type)) + " in 0.." + number_text(static_cast<double>(range.white)) + " to sRGB of 8 bits";
    note += range.note();
    if (not_finite > 0)
        note += "; " + std::to_string(not_finite) + " of them not finite, which is 0 or 255";
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
