// The strength of a laser's echo as a grey, for scans without colours.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

struct GreyColours {
    std::vector<Rgb8> colours; // sRGB; empty: all values are equal or none is finite
    std::string note;          // for the report
};

// From the second to the 98th hundredth of the values; the median is a middle grey. Values that are not finite are
// black.
GreyColours grey_colours(std::span<const float> intensities);

// What becomes of the intensities of a scan, by one rule for all formats. Where they are a field
// (FieldColumn::is_kept), a cloud has no greys of them: it is shown by height, or by that field. Points without colours
// have greys where they are no field, and where the scan has faces, since light shows the shape of these.
//
// Call this once the faces are known. `grey`: the note of the greys that the surface has as its colours; absent: it has
// colours of its own. Takes the greys away where there should be none.
AttributeReport settle_intensities(const std::string &name, const std::optional<std::string> &grey, bool is_field,
                                   Surface &surface);

// The same for intensities that are no field: makes them the colours of a surface without any.
void use_intensities(const std::string &name, std::span<const float> intensities, Surface &surface);

} // namespace pbm::build
