#include "pbm_scan/clouds/intensity.h"

#include "pbm_format/model/intensity_stretch.h"
#include "pbm_scan/text/printable.h"
#include "system/free_memory.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm::build {

GreyColours grey_colours(std::span<const float> intensities) {
    std::vector<float> sorted;
    sorted.reserve(intensities.size());
    std::copy_if(intensities.begin(), intensities.end(), std::back_inserter(sorted),
                 [](float value) { return std::isfinite(value); });
    if (sorted.empty())
        return {{}, "no value is finite"};
    const auto quantile = [&](std::size_t hundredths) {
        const auto at = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) * hundredths / 100);
        std::nth_element(sorted.begin(), at, sorted.end());
        return *at;
    };
    float low = quantile(kOmittedIntensities), high = quantile(100 - kOmittedIntensities);
    const float median = quantile(50);
    const bool are_most = low < high;
    if (!are_most) { // nearly all are equal
        const auto [least, most] = std::minmax_element(sorted.begin(), sorted.end());
        low = *least;
        high = *most;
    }
    if (!(low < high))
        return {{}, "all values are equal"};
    GreyColours grey;
    grey.colours.reserve(intensities.size());
    const auto [black, white] = std::array{static_cast<double>(low), static_cast<double>(high)};
    const double gamma = intensity_gamma(black, static_cast<double>(median), white);
    for (const float value : intensities) {
        const double part = std::clamp((static_cast<double>(value) - black) / (white - black), 0.0, 1.0);
        grey.colours.push_back(colour_bytes(glm::vec3(static_cast<float>(std::pow(part, gamma))), 255.0F));
    }
    grey.note = formatted("grey from %g (black) over %g (middle grey) to %g (white)%s", black,
                          static_cast<double>(median), white, are_most ? ", which hold 96 % of the values" : "");
    return grey;
}

AttributeReport settle_intensities(const std::string &name, const std::optional<std::string> &grey, bool is_field,
                                   Surface &surface) {
    if (!grey && !is_field)
        return {name, Fate::dropped, "the points have colours; --field " + printable(name) + " keeps it"};
    if (is_field && surface.triangles.empty() && grey)
        free_memory(surface.colours);
    if (!grey || surface.colours.empty())
        return {name, is_field ? Fate::kept : Fate::dropped, is_field ? "a field" : *grey};
    return {name, Fate::converted, is_field ? "a field, and " + *grey : *grey};
}

void use_intensities(const std::string &name, std::span<const float> intensities, Surface &surface) {
    std::optional<std::string> note;
    if (surface.colours.empty()) {
        GreyColours grey = grey_colours(intensities);
        surface.colours = std::move(grey.colours);
        note = std::move(grey.note);
    }
    surface.report.push_back(settle_intensities(name, note, false, surface));
}

} // namespace pbm::build
