// The strength of a laser's echo as a grey, for scans without colours.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <span>
#include <string>
#include <vector>

namespace pbm::build {

struct GreyColours {
    std::vector<Rgb8> colours; // sRGB; empty: all values are equal or none is finite
    std::string note;          // for the report
};

// Linear between the first and the last hundredth of the values, whose ends few echoes of mirrors would stretch. The
// scale of the values differs from scanner to scanner. Values that are not finite are black.
GreyColours grey_colours(std::span<const float> intensities);

// Makes the intensities the colours of a surface without any, and reports it. `why_dropped` is for the report of a
// surface that has colours; empty: they are kept otherwise.
void use_intensities(std::span<const float> intensities, Surface &surface, const std::string &why_dropped);

} // namespace pbm::build
