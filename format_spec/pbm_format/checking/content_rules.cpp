#include "pbm_format/checking/content_rules.h"

#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

namespace {

// Low half first, the order of the file.
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

Status check_fields_announced(const FileHeader &header, std::span<const SectionEntry> sections) {
    if (find_section(sections, SectionType::fields) == nullptr || (header.optional_features & kFieldsFeature) != 0)
        return {};
    return broken("17.1.2", 48, "the header does not announce the fields", kFieldsFeature, header.optional_features);
}

Status check_fields_id(ByteView section, std::uint64_t offset, const Level &finest) {
    const Result<FieldTable> table = decode_fields(section);
    const Hash128 id = table ? fields_id(*table, finest) : Hash128{};
    if (!table || id == table->id)
        return {};
    return broken("17.6.1", offset, "fields_id is not that of the fields", text_of(id), text_of(table->id));
}

Status check_field_average(const Field &field, std::size_t level, ByteView stored, ByteView computed,
                           std::uint64_t offset) {
    const auto differ = std::mismatch(stored.begin(), stored.end(), computed.begin(), computed.end());
    if (differ.first == stored.end() && differ.second == computed.end())
        return {};
    const std::size_t point = static_cast<std::size_t>(differ.first - stored.begin()) / field.bytes;
    return broken("17.3.1", offset,
                  "level " + std::to_string(level) + " does not hold the averages of the finest points: " + field.name +
                      " of point " + std::to_string(point),
                  stored_value(computed, point, field.bytes), stored_value(stored, point, field.bytes));
}

WrongAverage find_wrong_average(std::uint64_t offset, std::size_t level, const PointAttributes &stored,
                                const PointAttributes &computed, const AttributeSet &set) {
    WrongAverage wrong{.point = stored.size(), .error = {}};
    for_columns(
        set,
        [&](const StreamInfo &stream, std::size_t width, const auto &is, const auto &should) {
            const auto differ = std::mismatch(is.begin(), is.end(), should.begin());
            const std::size_t point =
                static_cast<std::size_t>(differ.first - is.begin()) / std::max<std::size_t>(1, width);
            if (differ.first == is.end() || point >= wrong.point)
                return;
            wrong = {point,
                     broken("7.1", offset,
                            "level " + std::to_string(level) + " does not hold the averages of the finest points: " +
                                std::string(traits_of(stream.kind).value_name) + " of point " + std::to_string(point),
                            *differ.second, *differ.first)};
        },
        stored, computed);
    return wrong;
}

} // namespace pbm
