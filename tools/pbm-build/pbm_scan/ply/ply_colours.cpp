#include "pbm_scan/ply/ply_colours.h"

#include "pbm_scan/text/text_number.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace pbm::build {
namespace {

using Fate = AttributeReport::Fate;

// Factor from the file's colours to 0..255; zero where the numbers are no colours. Floats in 0..255 and ushorts that
// never leave a byte are common.
float colour_factor(PlyScalar type, float highest) {
    constexpr float kOvershoot = 2.0F;
    if (is_float(type) && highest <= kOvershoot)
        return 255.0F;
    if (highest <= 255.0F)
        return 1.0F;
    return highest <= 65535.0F ? 255.0F / 65535.0F : 0.0F;
}

std::array<std::uint8_t, 3> to_bytes(const glm::vec3 &colour, float factor) {
    std::array<std::uint8_t, 3> bytes{};
    for (int i = 0; i < 3; ++i) {
        const float value = colour[i] * factor + 0.5F;
        bytes[static_cast<std::size_t>(i)] =
            value >= 0.0F ? static_cast<std::uint8_t>(std::min(value, 255.0F)) : 0; // NaN: 0
    }
    return bytes;
}

// Also for means of faces, where they stand per vertex already.
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
        surface.colours.push_back(to_bytes(colour, factor));
    const char *range = factor == 1.0F ? "0..255" : factor == 255.0F ? "0..1" : "0..65535";
    std::string note = std::string(to_string(type)) + " in " + range + " to sRGB of 8 bits";
    if (strange > 0)
        note += "; " + std::to_string(strange) + " of them negative or not finite, which is 0 or 255";
    return {Fate::converted, note};
}

PlyOutcome convert_splat_colours(const std::vector<glm::vec3> &coefficients, Surface &surface) {
    constexpr float kConstantHarmonic = 0.28209479F; // 1 / (2 sqrt(pi))
    surface.colours.reserve(coefficients.size());
    for (const glm::vec3 &c : coefficients)
        surface.colours.push_back(to_bytes(0.5F + c * kConstantHarmonic, 255.0F));
    return {Fate::converted, "a Gaussian splat's mean colour to sRGB of 8 bits"};
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
    std::vector<glm::vec3> means(body.face_colours.size(), glm::vec3(0.0F));
    std::size_t without = 0;
    for (std::size_t i = 0; i < means.size(); ++i) {
        const glm::vec4 &sum = body.face_colours[i];
        if (sum.w > 0)
            means[i] = glm::vec3(sum) / sum.w;
        else
            ++without;
    }
    if (without == means.size())
        return {Fate::dropped, "no vertex belongs to a face"};
    PlyOutcome outcome = convert_colours(roles.face_colour[0]->type, means, surface);
    if (outcome.fate != Fate::dropped) {
        outcome.note = "each vertex has the mean of its faces, sRGB, 8 bits";
        if (without != 0)
            outcome.note += "; " + std::to_string(without) + " vertices without a face are black";
    }
    return outcome;
}

} // namespace pbm::build
