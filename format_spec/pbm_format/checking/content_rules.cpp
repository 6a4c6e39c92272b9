#include "pbm_format/checking/content_rules.h"

#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

namespace {

// Low half first, as it lies in the file.
std::string text_of(const ContentId &id) { return to_string(hash_value(id[0])) + " " + to_string(hash_value(id[1])); }

} // namespace

Status check_padding(ByteView file, std::uint64_t from, std::uint64_t to) {
    const ByteView padding = slice(file, from, to - from);
    const auto bad = std::find_if(padding.begin(), padding.end(), [](std::uint8_t byte) { return byte != 0; });
    if (bad == padding.end())
        return {};
    return broken("3.2.12", from + static_cast<std::uint64_t>(bad - padding.begin()), "padding is not zero", 0, *bad);
}

Status check_content_id(const FileHeader &header, const ContentId &id) {
    if (id == header.content_id)
        return {};
    return broken("8.1", 72, "content_id is not that of the content", text_of(id), text_of(header.content_id));
}

WrongAverage find_wrong_average(std::uint64_t offset, std::size_t level, const PointAttributes &stored,
                                const PointAttributes &computed, const AttributeSet &set) {
    WrongAverage wrong{.point = stored.size(), .error = {}};
    const auto look = [&](const char *attribute, const auto &is, const auto &should, int per_point) {
        const auto differ = std::mismatch(is.begin(), is.end(), should.begin());
        const std::size_t point =
            static_cast<std::size_t>(differ.first - is.begin()) / static_cast<std::size_t>(per_point);
        if (differ.first == is.end() || point >= wrong.point)
            return;
        wrong = {point, broken("7.1", offset,
                               "level " + std::to_string(level) + " does not hold the averages of the finest points: " +
                                   attribute + " of point " + std::to_string(point),
                               *differ.second, *differ.first)};
    };
    look("normal", stored.normals, computed.normals, 1);
    look("radius", stored.radii, computed.radii, 1);
    look("colour", stored.colours, computed.colours, std::max(1, set.colour_bytes()));
    look("material", stored.materials, computed.materials, 1);
    look("texture value", stored.textures, computed.textures, 1);
    for (std::size_t light = 0; light < stored.shadows.size(); ++light)
        look("lit fraction", stored.shadows[light], computed.shadows[light], 1);
    return wrong;
}

} // namespace pbm
