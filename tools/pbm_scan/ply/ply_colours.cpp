#include "pbm_scan/ply/ply_colours.h"

#include "pbm_scan/clouds/gaussian_splats.h"
#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/text/text_number.h"

#include <algorithm>
#include <vector>

namespace pbm::build {
namespace {

// The widest of the three.
PlyScalar type_of(const PlyRoles::Three &channels) {
    PlyScalar type = PlyScalar::int8;
    for (const PlyProperty *channel : channels)
        type = std::max(type, channel->type);
    return type;
}

// Finds the range of `wide`, the colours of vertices or faces; white 0: they are no colours.
PlyOutcome find_range(PlyScalar type, std::vector<glm::vec3> &wide, ColourRange &range) {
    std::size_t not_finite = 0;
    for (glm::vec3 &colour : wide) {
        for (int i = 0; i < 3 && type == PlyScalar::int8; ++i)
            if (colour[i] < 0)
                colour[i] += 256; // a byte that was declared with a sign
        not_finite += is_finite(glm::dvec3(colour)) ? 0U : 1U;
    }
    if (type != PlyScalar::uint8)
        range = colour_range(wide, is_float(type) ? ColourNumbers::any : ColourNumbers::whole);
    if (range.white == 0)
        return {Fate::dropped, "nearly all are above 65,535: these are no colours"};
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
    ColourRange range;
    PlyOutcome outcome = find_range(type_of(roles.colour), body.wide_colours, range);
    if (range.white == 0)
        return outcome;
    surface.colours.reserve(body.wide_colours.size());
    for (const glm::vec3 &colour : body.wide_colours)
        surface.colours.push_back(colour_bytes(colour, range.factor()));
    return outcome;
}

PlyOutcome finish_face_colours(const PlyRoles &roles, PlyBody &body, Surface &surface) {
    if (body.face_colours.empty())
        return {Fate::dropped, "there are no faces"};
    ColourRange range;
    const PlyScalar type = type_of(roles.face_colour);
    PlyOutcome outcome = find_range(type, body.face_colours, range);
    if (range.white == 0)
        return outcome;
    surface.face_colours = face_colours(body.face_colours, range);
    if (type == PlyScalar::uint8)
        return {Fate::kept, "each face has its own, sRGB, 8 bits"};
    return {outcome.fate, "each face has its own, " + outcome.note};
}

} // namespace pbm::build
