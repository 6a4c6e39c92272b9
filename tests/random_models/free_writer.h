// A writer that makes every choice of the format at random, within the rules of BVG.md.
#pragma once

#include "pbm_format/model/model.h"
#include "unit/support/test_models.h"

namespace pbm::test {

// A file of `model`, packed or mapped, whose chunk limit, filters, frames, escapes, normal cones, element sizes,
// alignments, flags, optional feature bits and sections of unknown types are drawn at random.
Bytes write_freely(const Model &model, Random &random);

} // namespace pbm::test
