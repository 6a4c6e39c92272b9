#include "pbm_bake/padded_brick.h"

#include "pbm_format/model/octree.h"

namespace pbm {

const std::vector<std::array<std::int16_t, 512>> &padded_places() {
    static const auto table = [] {
        std::vector<std::array<std::int16_t, 512>> all(27);
        for (int shift = 0; shift < 27; ++shift)
            for (MortonCode place = 0; place < 512; ++place) {
                const auto local = morton_decode(place);
                int index = 0;
                bool inside = true;
                for (int axis = 2, step = shift; axis >= 0; --axis) {
                    const int bricks = (axis == 2 ? step / 9 : axis == 1 ? step / 3 % 3 : step % 3) - 1;
                    const int at = static_cast<int>(local[static_cast<std::size_t>(axis)]) + 1 + kBrickEdge * bricks;
                    inside &= at >= 0 && at < kPaddedEdge;
                    index = index * kPaddedEdge + at;
                }
                all[static_cast<std::size_t>(shift)][place] = static_cast<std::int16_t>(inside ? index : -1);
            }
        return all;
    }();
    return table;
}

} // namespace pbm
