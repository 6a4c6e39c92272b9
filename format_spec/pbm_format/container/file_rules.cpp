#include "pbm_format/container/file_rules.h"

#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

namespace {

// Low half first, as it lies in the file.
std::string text_of(const ContentId &id) { return to_string(hash_value(id[0])) + " " + to_string(hash_value(id[1])); }

} // namespace

Status prove_hash(ByteView stored, const SectionEntry &section) {
    const std::uint64_t hash = hash64(stored);
    if (hash == section.hash)
        return {};
    return broken("3.2.14", section.offset,
                  "the " + std::string(to_string(section.type)) + " section was changed: its hash does not match",
                  hash_value(section.hash), hash_value(hash));
}

Status check_padding(ByteView file, std::uint64_t from, std::uint64_t to) {
    const ByteView padding = slice(file, from, to - from);
    const auto bad = std::find_if(padding.begin(), padding.end(), [](std::uint8_t byte) { return byte != 0; });
    if (bad == padding.end())
        return {};
    return broken("3.2.12", from + static_cast<std::uint64_t>(bad - padding.begin()), "padding is not zero", 0, *bad);
}

Status check_point_count(const FileHeader &header, const SectionEntry &finest_chunks) {
    if (finest_chunks.count == header.point_count)
        return {};
    return broken("2.18", 56, "the header's point count is not that of the finest level", finest_chunks.count,
                  header.point_count);
}

Status check_chunk_count(const LevelDirectory &directory, const SectionEntry &entry,
                         std::span<const SectionEntry> sections) {
    if (entry.count == directory.chunks.size())
        return {};
    const auto number = static_cast<std::uint64_t>(&entry - sections.data());
    return broken("5.5.11", kHeaderBytes + number * kSectionEntryBytes + 48,
                  "the section table counts other chunks than there are", directory.chunks.size(), entry.count);
}

Error wrong_split(std::uint64_t offset, const ChunkShape *expected, const ChunkShape *actual) {
    const auto text = [](const ChunkShape *shape) {
        return shape == nullptr
                   ? Value("no chunk")
                   : Value("root " + std::to_string(shape->root_prefix) + " of level " +
                           std::to_string(shape->root_depth) + ", " + std::to_string(shape->points) + " points, " +
                           std::to_string(shape->nodes) + " nodes, " + std::to_string(shape->parents) + " parents, " +
                           std::to_string(shape->bricks) + " bricks");
    };
    return broken("5.2", offset, "the chunk is not a maximal subtree within the limit", text(expected), text(actual));
}

Status check_content_id(const FileHeader &header, const ContentId &id) {
    if (id == header.content_id)
        return {};
    return broken("8.1", 72, "content_id is not that of the content", text_of(id), text_of(header.content_id));
}

namespace {

template <class T> std::size_t first_difference(const std::vector<T> &a, const std::vector<T> &b) {
    return static_cast<std::size_t>(std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first - a.begin());
}

} // namespace

WrongAverage find_wrong_average(const PointAttributes &stored, const PointAttributes &computed,
                                const AttributeSet &set) {
    WrongAverage wrong{.point = stored.size(), .attribute = "", .expected = {}, .actual = {}};
    const auto look = [&](const char *attribute, const auto &is, const auto &should, std::size_t per_point) {
        const std::size_t at = first_difference(is, should);
        if (at >= is.size() || at / per_point >= wrong.point)
            return;
        wrong = {at / per_point, attribute, should[at], is[at]};
    };
    look("normal", stored.normals, computed.normals, 1);
    look("radius", stored.radii, computed.radii, 1);
    look("colour", stored.colours, computed.colours, static_cast<std::size_t>(std::max(1, set.colour_bytes())));
    look("material", stored.materials, computed.materials, 1);
    look("texture value", stored.textures, computed.textures, 1);
    for (std::size_t light = 0; light < stored.shadows.size(); ++light)
        look("lit fraction", stored.shadows[light], computed.shadows[light], 1);
    return wrong;
}

Error wrong_averages(std::uint64_t offset, std::size_t level, const WrongAverage &first) {
    return broken("7.1", offset,
                  "level " + std::to_string(level) + " does not hold the averages of the finest points: " +
                      first.attribute + " of point " + std::to_string(first.point),
                  first.expected, first.actual);
}

} // namespace pbm
