// The range of the numbers that a file stores as colours. Few formats say it, so nearly all values decide.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

inline constexpr glm::vec3 kNoColour(std::numeric_limits<float>::quiet_NaN()); // of a vertex or face without one
inline bool is_no_colour(const glm::vec3 &c) { return std::isnan(c.x) && std::isnan(c.y) && std::isnan(c.z); }

// What the numbers of colours are by their type: whole ones are never fractions of 1.
enum class ColourNumbers : std::uint8_t { whole, any };

struct ColourRange {
    float white = 255; // 1, 255 or 65535; 0: the numbers are no colours
    std::uint64_t outside = 0;

    float factor() const { return 255.0F / white; } // to 0..255
    std::string note() const;                       // "; 3 colours outside clamped", or nothing
};

// Counts colours by their highest channel.
class ColourCounts {
  public:
    // Channels that are not finite are ignored.
    void add(const glm::vec3 &colour, std::uint64_t times = 1) {
        float lowest = 0, highest = 0;
        for (int i = 0; i < 3; ++i)
            if (const float value = colour[i]; value - value == 0) {
                lowest = std::min(lowest, value);
                highest = std::max(highest, value);
                are_whole_ = are_whole_ && is_whole(value);
            }
        lit_ += highest > 0 ? times : 0U;
        above_one_ += highest > 1 ? times : 0U;
        above_two_ += highest > 2 ? times : 0U;
        above_byte_ += highest > 255 ? times : 0U;
        above_word_ += highest > 65535 ? times : 0U;
        negative_one_ += lowest < 0 && !(highest > 1) ? times : 0U;
        negative_byte_ += lowest < 0 && !(highest > 255) ? times : 0U;
        negative_word_ += lowest < 0 && !(highest > 65535) ? times : 0U;
    }

    // 1 where all but a hundredth of the colours that are not black are at most 1. If some are no whole numbers, values
    // up to 2 are overshoot of a filter or of rounding; and of fewer than 100 colours, half may be brighter than white.
    // Then likewise 255 and 65535. `outside` counts colours beyond the range, which are clamped.
    ColourRange range(ColourNumbers numbers) const;

  private:
    static bool is_whole(float value) {
        constexpr float kAllAreWhole = 8388608; // 2^23: from here on floats have no fractions
        return !(std::abs(value) < kAllAreWhole) || value == static_cast<float>(static_cast<std::int32_t>(value));
    }

    std::uint64_t lit_ = 0, above_one_ = 0, above_two_ = 0, above_byte_ = 0, above_word_ = 0;
    std::uint64_t negative_one_ = 0, negative_byte_ = 0, negative_word_ = 0; // of those that are not above
    bool are_whole_ = true;
};

// Of words of 16 bits: so many are not black, and so many of these have a channel above 255.
ColourRange range_of_words(std::uint64_t lit, std::uint64_t above_byte);

ColourRange colour_range(std::span<const glm::vec3> colours, ColourNumbers numbers);

// Colours of faces in this range; kNoColour becomes one that is not given.
std::vector<FaceColour> face_colours(std::span<const glm::vec3> colours, const ColourRange &range);

} // namespace pbm::build
