#include "pbm_scan/clouds/intensity.h"

#include "pbm_scan/text/printable.h"

#include <algorithm>
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
    float low = quantile(1), high = quantile(99);
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
    for (const float value : intensities)
        grey.colours.push_back(colour_bytes(glm::vec3(value - low), 255.0F / (high - low)));
    grey.note = formatted("grey from %g (black) to %g (white)%s", static_cast<double>(low), static_cast<double>(high),
                          are_most ? ", which hold 98 % of the values" : "");
    return grey;
}

void use_intensities(std::span<const float> intensities, Surface &surface, const std::string &why_dropped) {
    if (!surface.colours.empty()) {
        if (!why_dropped.empty())
            surface.report.push_back({"intensity", Fate::dropped, why_dropped});
        return;
    }
    GreyColours grey = grey_colours(intensities);
    surface.colours = std::move(grey.colours);
    surface.report.push_back(
        {"intensity", surface.colours.empty() ? Fate::dropped : Fate::converted, std::move(grey.note)});
}

} // namespace pbm::build
