// The scale bar of a picture: a length of 1, 2 or 5 times a power of ten.
#pragma once

#include "pbm_format/model/model.h"

#include <string>

namespace pbm {

struct ScaleBar {
    double length; // model units
    double pixels;
    std::string text; // "20 mm"; metres below one are centimetres or millimetres
};

// The longest bar of at most `max_pixels` where a pixel has this edge in model units; both above 0.
ScaleBar scale_bar(double pixel_size, double max_pixels, Unit unit);

// "m", or "units" if the file does not say.
std::string unit_text(Unit unit);

} // namespace pbm
