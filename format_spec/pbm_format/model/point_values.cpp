#include "pbm_format/model/point_values.h"

#include <algorithm>
#include <cmath>

namespace pbm {

namespace {

// round(65,535 x sRGB decoding of i / 255). BVG.md table 6.3.
constexpr std::array<std::uint16_t, 256> kLinear{
    0,     20,    40,    60,    80,    99,    119,   139,   159,   179,   199,   219,   241,   264,   288,   313,
    340,   367,   396,   427,   458,   491,   526,   562,   599,   637,   677,   718,   761,   805,   851,   898,
    947,   997,   1048,  1101,  1156,  1212,  1270,  1330,  1391,  1453,  1517,  1583,  1651,  1720,  1790,  1863,
    1937,  2013,  2090,  2170,  2250,  2333,  2418,  2504,  2592,  2681,  2773,  2866,  2961,  3058,  3157,  3258,
    3360,  3464,  3570,  3678,  3788,  3900,  4014,  4129,  4247,  4366,  4488,  4611,  4736,  4864,  4993,  5124,
    5257,  5392,  5530,  5669,  5810,  5953,  6099,  6246,  6395,  6547,  6700,  6856,  7014,  7174,  7335,  7500,
    7666,  7834,  8004,  8177,  8352,  8528,  8708,  8889,  9072,  9258,  9445,  9635,  9828,  10022, 10219, 10417,
    10619, 10822, 11028, 11235, 11446, 11658, 11873, 12090, 12309, 12530, 12754, 12980, 13209, 13440, 13673, 13909,
    14146, 14387, 14629, 14874, 15122, 15371, 15623, 15878, 16135, 16394, 16656, 16920, 17187, 17456, 17727, 18001,
    18277, 18556, 18837, 19121, 19407, 19696, 19987, 20281, 20577, 20876, 21177, 21481, 21787, 22096, 22407, 22721,
    23038, 23357, 23678, 24002, 24329, 24658, 24990, 25325, 25662, 26001, 26344, 26688, 27036, 27386, 27739, 28094,
    28452, 28813, 29176, 29542, 29911, 30282, 30656, 31033, 31412, 31794, 32179, 32567, 32957, 33350, 33745, 34143,
    34544, 34948, 35355, 35764, 36176, 36591, 37008, 37429, 37852, 38278, 38706, 39138, 39572, 40009, 40449, 40891,
    41337, 41785, 42236, 42690, 43147, 43606, 44069, 44534, 45002, 45473, 45947, 46423, 46903, 47385, 47871, 48359,
    48850, 49344, 49841, 50341, 50844, 51349, 51858, 52369, 52884, 53401, 53921, 54445, 54971, 55500, 56032, 56567,
    57105, 57646, 58190, 58737, 59287, 59840, 60396, 60955, 61517, 62082, 62650, 63221, 63795, 64372, 64952, 65535};

// Tables for the inverse of kLinear, which then takes one step.
struct SrgbSteps {
    static constexpr std::uint32_t kWidth = 16;
    std::array<std::uint16_t, 256> last{};            // largest linear value that rounds to each sRGB value
    std::array<std::uint8_t, 65536 / kWidth> first{}; // sRGB value of linear value kWidth x i

    constexpr SrgbSteps() {
        for (std::size_t i = 0; i < 255; ++i)
            last[i] = static_cast<std::uint16_t>((kLinear[i] + kLinear[i + 1]) / 2);
        last[255] = 65535;
        std::uint8_t value = 0;
        for (std::size_t i = 0; i < first.size(); ++i) {
            while (kWidth * i > last[value])
                ++value;
            first[i] = value;
        }
    }
};
constexpr SrgbSteps kSteps;
// A window of kWidth contains at most one step.
static_assert([] {
    for (std::size_t i = 0; i < 255; ++i)
        if (kSteps.last[i + 1] - kSteps.last[i] < static_cast<int>(SrgbSteps::kWidth))
            return false;
    return true;
}());

// floor(2^40 x 2^(j/12)): one octave of the radius table. BVG.md table 6.2.
constexpr std::array<std::uint64_t, 12> kRadiusOctave{1099511627776, 1164891991447, 1234160073853, 1307547050779,
                                                      1385297844439, 1467671940878, 1554944255987, 1647406053004,
                                                      1745365914582, 1849150772653, 1959106999532, 2075601563905};

// floor(2^40 x sqrt(3) / 4): distance between the centres of a node with edge 1 and of its child.
constexpr std::uint64_t kChildDistance = 476102500705;

} // namespace

std::uint16_t pack_565(Rgb8 colour) {
    const unsigned r = (colour[0] * 31U + 127U) / 255U, g = (colour[1] * 63U + 127U) / 255U,
                   b = (colour[2] * 31U + 127U) / 255U;
    return static_cast<std::uint16_t>(r << 11 | g << 5 | b);
}

std::span<const std::uint16_t> linear_table() { return kLinear; }

std::uint8_t linear_to_srgb(std::uint32_t linear) {
    const std::uint32_t value = std::min(linear, std::uint32_t{65535});
    const std::uint8_t first = kSteps.first[value / SrgbSteps::kWidth];
    return static_cast<std::uint8_t>(first + (value > kSteps.last[first] ? 1 : 0));
}

std::uint64_t radius_fixed(std::uint8_t index) {
    const unsigned place = index + 9U; // index 255 is place 264 = 22 octaves, the grid's edge
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
