#include "pbm_format/model/radius.h"

#include <array>
#include <cmath>

namespace pbm {

namespace {

// floor(2^40 x 2^(j/12)): one octave of the radius table. BVG.md table 6.2.
constexpr std::array<std::uint64_t, 12> kRadiusOctave{1099511627776, 1164891991447, 1234160073853, 1307547050779,
                                                      1385297844439, 1467671940878, 1554944255987, 1647406053004,
                                                      1745365914582, 1849150772653, 1959106999532, 2075601563905};

// floor(2^40 x sqrt(3) / 4): from the centre of a node with edge 1 to the centre of a child.
constexpr std::uint64_t kChildDistance = 476102500705;

} // namespace

std::uint64_t radius_fixed(std::uint8_t index) {
    const unsigned place = index + 9U; // index 255 is place 264 = 22 octaves: the grid's edge
    return kRadiusOctave[place % 12] >> (22 - place / 12);
}

double radius_fraction(std::uint8_t index) { return static_cast<double>(radius_fixed(index)) * 0x1p-40; }

namespace {

std::uint8_t first_radius_at_least(std::uint64_t fixed) {
    unsigned low = 0, high = 255;
    while (low < high) {
        const unsigned middle = (low + high) / 2;
        if (radius_fixed(static_cast<std::uint8_t>(middle)) >= fixed)
            high = middle;
        else
            low = middle + 1;
    }
    return static_cast<std::uint8_t>(low);
}

} // namespace

std::uint8_t radius_index(double fraction) {
    if (!(fraction > 0))
        return 0;
    if (fraction >= 1)
        return 255;
    return first_radius_at_least(static_cast<std::uint64_t>(std::ceil(fraction * 0x1p40)));
}

std::uint8_t covering_radius(std::uint8_t child_index, int level) {
    return first_radius_at_least(radius_fixed(child_index) + (kChildDistance >> level));
}

} // namespace pbm
