#include "pbm_scan/conventions/colour_range.h"

#include "pbm_scan/text/printable.h"

namespace pbm::build {

namespace {

bool is_few(std::uint64_t count, std::uint64_t of) { return count < (of + 99) / 100 || count == 0; }

} // namespace

ColourRange range_of_words(std::uint64_t lit, std::uint64_t above_byte) {
    return is_few(above_byte, lit) ? ColourRange{255, above_byte} : ColourRange{65535, 0};
}

ColourRange ColourCounts::range(ColourNumbers numbers) const {
    const auto are_few = [this](std::uint64_t count) { return is_few(count, lit_); };
    constexpr std::uint64_t kFewColours = 100;
    const bool are_some_brighter = are_few(above_two_) || (lit_ < kFewColours && 2 * above_one_ <= lit_);
    if (numbers == ColourNumbers::any && (above_one_ == 0 || (are_some_brighter && !are_whole_)))
        return {1, negative_one_ + above_one_};
    if (are_few(above_byte_))
        return {255, negative_byte_ + above_byte_};
    return are_few(above_word_) ? ColourRange{65535, negative_word_ + above_word_} : ColourRange{0, 0};
}

std::string ColourRange::note() const {
    return outside == 0 ? "" : "; " + counted(outside, "colour") + " outside clamped";
}

ColourRange colour_range(std::span<const glm::vec3> colours, ColourNumbers numbers) {
    ColourCounts counts;
    for (std::size_t i = 0, end = 0; i < colours.size(); i = end) {
        while (++end < colours.size() && colours[end] == colours[i]) { // runs of one colour, as faces have them
        }
        counts.add(colours[i], end - i);
    }
    return counts.range(numbers);
}

std::vector<FaceColour> face_colours(std::span<const glm::vec3> colours, const ColourRange &range) {
    std::vector<FaceColour> of_faces;
    of_faces.reserve(colours.size());
    for (std::size_t i = 0; i < colours.size(); ++i)
        if (i > 0 && colours[i] == colours[i - 1])
            of_faces.push_back(of_faces.back());
        else
            of_faces.push_back(is_no_colour(colours[i]) ? FaceColour{}
                                                        : FaceColour{colour_bytes(colours[i], range.factor()), true});
    return of_faces;
}

} // namespace pbm::build
