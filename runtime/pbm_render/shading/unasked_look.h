// How a model is shown where nobody asks for anything.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/shading/depth_cue.h"

#include <string>

namespace pbm {

struct UnaskedLook {
    std::string colour_by; // as choose_field_colours takes it; empty: the colours of the file
    DepthCue depth_cue = DepthCue::none;
    bool from_above = false; // Extent::from_above
};

// The metadata of a cloud without faces, colours and normals says so (BVG.md 3.3): estimated normals and a single
// colour do not show what it is. It has the colours of heights, and eye-dome lighting, and is seen from above if its
// place on a map is known and z points up. Any other model is shown as the file has it.
UnaskedLook unasked_look(const Reader &reader);

} // namespace pbm
