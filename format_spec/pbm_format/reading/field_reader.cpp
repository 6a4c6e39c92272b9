#include "pbm_format/reading/field_reader.h"

#include "pbm_format/chunks/field_chunk.h"
#include "pbm_format/container/file_rules.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <optional>

namespace pbm {

Result<FieldReader> FieldReader::open(const Reader &reader) {
    const SectionEntry *const section = reader.section(SectionType::fields);
    if (section == nullptr)
        return usage_error("the file has no fields");
    FieldReader fields(reader);
    const Result<HeldBytes> stored = reader.source().require(section->range());
    if (!stored)
        return stored.error();
    Result<FieldTable> table = decode_fields(stored->bytes); // Reader::open has verified its hash
    if (!table)
        return table.error();
    fields.table_ = std::move(*table);
    fields.directories_.resize(static_cast<std::size_t>(reader.depth()) + 1);
    return fields;
}

Bytes FieldReader::root_value(std::size_t field) const {
    Bytes value(table_.fields[field].bytes);
    set_stored_value(value, 0, table_.fields[field].bytes, table_.roots[field]);
    return value;
}

Result<FieldDirectory> FieldReader::directory(const LevelDirectory &level) const {
    const auto instance = static_cast<std::uint32_t>(level.level);
    const SectionEntry &entry = *reader_->section(SectionType::field_directory, instance);
    const Result<HeldBytes> stored = reader_->source().require(entry.range());
    if (!stored)
        return stored.error();
    if (Status status = verify_hash(stored->bytes, entry); !status)
        return std::move(status).error();
    Result<FieldDirectory> directory = decode_field_directory(stored->bytes, level, table_.fields,
                                                              *reader_->section(SectionType::field_values, instance));
    if (!directory)
        directory.error().offset += entry.offset;
    return directory;
}

Status FieldReader::read_directory(const LevelDirectory &level) {
    Result<FieldDirectory> read = directory(level);
    if (!read)
        return std::move(read).error();
    directories_[static_cast<std::size_t>(level.level)] = std::move(*read);
    reader_->source().drop(directory_range(level.level));
    return {};
}

Status FieldReader::load(int level, std::size_t index, std::size_t field, ByteView masks, ByteView parents,
                         Bytes &to) const {
    const FieldEntry &values = entry(level, index, field);
    const Result<HeldBytes> stored = reader_->source().require(values.range());
    if (!stored)
        return stored.error();
    return decode_field(values, table_.fields[field], stored->bytes, masks, parents, to);
}

Status load_fields(Reader &reader, int threads, Model &model) {
    if (reader.parameters().fields.empty())
        return {};
    Result<FieldReader> fields = FieldReader::open(reader);
    if (!fields)
        return fields.error();
    const std::size_t count = fields->fields().size();
    for (std::size_t f = 0; f < count; ++f)
        model.levels[0].fields.push_back(fields->root_value(f));
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(static_cast<int>(level));
        if (!directory)
            return directory.error();
        if (Status status = fields->read_directory(**directory); !status)
            return status;
        Level &here = model.levels[level];
        const Level &above = model.levels[level - 1];
        here.fields.resize(count);
        for (std::size_t f = 0; f < count; ++f)
            here.fields[f].resize(static_cast<std::size_t>((*directory)->points) * fields->fields()[f].bytes);
        std::vector<std::optional<Error>> failures((*directory)->chunks.size());
        parallel_for(failures.size(), threads, [&](std::size_t i) {
            const ChunkEntry &chunk = (*directory)->chunks[i];
            Bytes values;
            for (std::size_t f = 0; f < count && !failures[i]; ++f) {
                const std::uint64_t bytes = fields->fields()[f].bytes;
                const Status loaded =
                    fields->load(static_cast<int>(level), i, f, slice(here.masks, chunk.first_node, chunk.shape.nodes),
                                 slice(above.fields[f], bytes * chunk.first_node, bytes * chunk.shape.nodes), values);
                if (loaded)
                    std::copy(values.begin(), values.end(),
                              here.fields[f].begin() + static_cast<std::ptrdiff_t>(bytes * chunk.first_point));
                else
                    failures[i] = loaded.error();
            }
        });
        for (std::optional<Error> &failure : failures)
            if (failure)
                return std::move(*failure);
    }
    return {};
}

} // namespace pbm
