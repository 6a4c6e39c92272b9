#include "pbm_format/checking/content_rules.h"

#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

namespace {

// Low half first, the order of the file.
std::string text_of(const ContentId &id) { return to_string(hash_value(id[0])) + " " + to_string(hash_value(id[1])); }

std::string wrong_level(int level) {
    return "level " + std::to_string(level) + " does not hold the averages of the finest points: ";
}

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

Status check_fields_announced(const FileHeader &header, std::span<const SectionEntry> sections) {
    if (find_section(sections, SectionType::fields) == nullptr || (header.optional_features & kFieldsFeature) != 0)
        return {};
    return broken("17.1.2", 48, "the header does not announce the fields", kFieldsFeature, header.optional_features);
}

Status check_fields_id(const FieldTable &table, const Hash128 &id, std::uint64_t offset) {
    if (id == table.id)
        return {};
    return broken("17.6.1", offset, "fields_id is not that of the fields", text_of(id), text_of(table.id));
}

std::optional<WrongAverage> find_wrong_average(std::uint64_t offset, int level, std::uint64_t first,
                                               const PointView &stored, const PointView &computed,
                                               const AttributeSet &set) {
    std::optional<WrongAverage> wrong;
    for_columns(
        set,
        [&](const StreamInfo &stream, std::size_t width, const auto &is, const auto &should) {
            const auto differ = std::mismatch(is.begin(), is.end(), should.begin());
            const std::uint64_t point =
                first + static_cast<std::size_t>(differ.first - is.begin()) / std::max<std::size_t>(1, width);
            if (differ.first == is.end() || (wrong && point >= wrong->point))
                return;
            wrong = {point, broken("7.1", offset,
                                   wrong_level(level) + std::string(traits_of(stream.kind).value_name) + " of point " +
                                       std::to_string(point),
                                   *differ.second, *differ.first)};
        },
        stored, computed);
    return wrong;
}

std::optional<WrongAverage> find_wrong_average(std::uint64_t offset, int level, std::uint64_t first, const Field &field,
                                               ByteView stored, ByteView computed) {
    const auto differ = std::mismatch(stored.begin(), stored.end(), computed.begin(), computed.end());
    if (differ.first == stored.end())
        return std::nullopt;
    const std::size_t at = static_cast<std::size_t>(differ.first - stored.begin()) / field.bytes;
    const std::uint64_t point = first + at;
    return WrongAverage{point,
                        broken("17.3.1", offset, wrong_level(level) + field.name + " of point " + std::to_string(point),
                               stored_value(computed, at, field.bytes), stored_value(stored, at, field.bytes))};
}

} // namespace pbm
