// Keeps one connected piece of a surface.
#pragma once

#include "isosurface.h"

namespace pbm::sample {

// Keeps only the connected piece with the most vertices (the first of equals), without floating splinters and inner
// bubbles. The order of what remains does not change.
void keep_largest_piece(Isosurface &surface);

} // namespace pbm::sample
