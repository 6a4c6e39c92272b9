// Keeps one connected piece of a surface.
#pragma once

#include "isosurface.h"

namespace pbm::sample {

// Drops everything but the connected piece with most vertices (of equals, the first): splinters that hang in the air
// and bubbles inside. The order of what stays does not change.
void keep_largest_piece(Isosurface &surface);

} // namespace pbm::sample
