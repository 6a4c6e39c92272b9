#include "pbm_format/container/field_sections.h"

#include "pbm_format/law/catalogue.h"
#include "system/error.h"
#include "system/utf8.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace pbm {

namespace {

constexpr std::size_t kUnitAt = 32, kOffsetAt = 48, kBytesAt = 64, kRootAt = 66, kReservedAt = 68; // in a record

// Whether the text is UTF-8 without control characters.
bool is_printable(std::string_view text) {
    while (!text.empty()) {
        const Utf8Character next = utf8_character(text);
        if (next.bytes == 0 || is_control(next.code))
            return false;
        text.remove_prefix(next.bytes);
    }
    return true;
}

// A text that zeros fill up to `size` bytes; empty: it is none.
std::optional<std::string> read_text(ByteView bytes) {
    const auto end = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
    const std::string text(bytes.begin(), end);
    const bool is_filled = std::all_of(end, bytes.end(), [](std::uint8_t byte) { return byte == 0; });
    return is_filled && is_printable(text) ? std::optional(text) : std::nullopt;
}

void append_text(std::string_view text, std::size_t size, ByteWriter &out) {
    out.append(as_bytes(text));
    out.zeros(size - text.size());
}

// 17.2.2
Status read_names(ByteView record, std::size_t at, std::span<const Field> before, Field &field) {
    const std::optional<std::string> name = read_text(record.first(kMaxFieldName));
    const std::optional<std::string> unit = read_text(record.subspan(kUnitAt, kMaxFieldUnit));
    if (!name || name->empty())
        return broken("17.2.2", at, "the name of a field is no text");
    if (!unit)
        return broken("17.2.2", at + kUnitAt, "the unit of a field is no text");
    if (std::any_of(before.begin(), before.end(), [&](const Field &other) { return other.name == *name; }))
        return broken("17.2.2", at, "two fields have the same name", {}, *name);
    field.name = *name;
    field.unit = *unit;
    return {};
}

Status read_field(ByteView record, std::size_t at, FieldTable &table) {
    Field field;
    if (Status status = read_names(record, at, table.fields, field); !status)
        return status;
    ByteReader in(record.subspan(kOffsetAt));
    field.offset = in.f64();
    field.scale = in.f64();
    field.bytes = in.u8();
    const std::uint8_t average = in.u8();
    const std::uint16_t root = in.u16();
    in.zeros(kFieldRecordBytes - kReservedAt);
    if (field.bytes != 1 && field.bytes != 2)
        return broken("17.2.4", at + kBytesAt, "a field's values have a size that this program does not know", "1 or 2",
                      field.bytes);
    if (average >= kFieldAverages)
        return broken("17.2.4", at + kBytesAt + 1, "a field has an average that this program does not know", "0..2",
                      average);
    if (!std::isfinite(field.offset) || !std::isnormal(field.scale) || field.scale < 0 ||
        !std::isfinite(field.value(field.max_stored())))
        return broken("17.2.3", at + kOffsetAt, "offset or scale of a field is out of range",
                      "finite, scale positive and normal",
                      to_string(Value(field.offset)) + ", " + to_string(Value(field.scale)));
    if (root > field.max_stored())
        return broken("17.2.5", at + kRootAt, "the root's value of a field is out of range",
                      "at most " + std::to_string(field.max_stored()), root);
    if (!in.reserved_clear())
        return broken("17.2.6", at + kReservedAt, "reserved bytes are not zero", 0, in.reserved());
    field.average = FieldAverage{average};
    table.fields.push_back(std::move(field));
    table.roots.push_back(root);
    return {};
}

Bytes encode_records(const FieldTable &table) {
    ByteWriter out;
    for (std::size_t f = 0; f < table.fields.size(); ++f) {
        const Field &field = table.fields[f];
        append_text(field.name, kMaxFieldName, out);
        append_text(field.unit, kMaxFieldUnit, out);
        out.f64(field.offset);
        out.f64(field.scale);
        out.u8(field.bytes);
        out.u8(static_cast<std::uint8_t>(field.average));
        out.u16(table.roots[f]);
        out.zeros(kFieldRecordBytes - kReservedAt);
    }
    return out.take();
}

} // namespace

Result<FieldTable> decode_fields(ByteView bytes) {
    const std::size_t count = bytes.size() < kFieldsIdBytes ? 0 : (bytes.size() - kFieldsIdBytes) / kFieldRecordBytes;
    if (count < 1 || count > kMaxFields || bytes.size() != kFieldsIdBytes + count * kFieldRecordBytes)
        return broken("17.2.1", 0, "the fields section is not 16 bytes and 1 to 8 records of 96", "112..784",
                      bytes.size());
    FieldTable table;
    ByteReader in(bytes);
    table.id = {in.u64(), in.u64()};
    for (std::size_t f = 0; f < count; ++f) {
        const std::size_t at = kFieldsIdBytes + f * kFieldRecordBytes;
        if (Status status = read_field(bytes.subspan(at, kFieldRecordBytes), at, table); !status)
            return status.error();
    }
    return table;
}

Bytes encode_fields(const FieldTable &table) {
    ByteWriter out;
    out.u64(table.id[0]);
    out.u64(table.id[1]);
    out.append(encode_records(table));
    return out.take();
}

Hash128 fields_id(const FieldTable &table, const Level &finest) {
    StreamingHash hash;
    hash.add(encode_records(table));
    for (const Bytes &column : finest.fields)
        hash.add(column);
    return hash.finish();
}

FieldTable field_table(const Model &model) {
    FieldTable table{.id = {}, .fields = model.parameters.fields, .roots = {}};
    for (std::size_t f = 0; f < table.fields.size(); ++f)
        table.roots.push_back(
            static_cast<std::uint16_t>(stored_value(model.levels[0].fields[f], 0, table.fields[f].bytes)));
    table.id = fields_id(table, model.levels.back());
    return table;
}

namespace {

// 17.4.2 to 17.4.4
Status check_entry(const FieldEntry &entry, const Field &field, std::uint64_t raw, bool mapped, std::uint64_t at) {
    const StreamEntry &stream = entry.stream;
    const Filter filter = filter_of(field);
    if (stream.filter != Filter::none && stream.filter != filter)
        return broken("17.4.2", at, field.name + ": a filter this program does not know",
                      "0 or " + std::to_string(static_cast<int>(filter)), static_cast<unsigned>(stream.filter));
    const bool is_raw = stream.filter == Filter::none && !stream.zstd;
    const bool possible = is_raw
                              ? stream.stored_bytes == raw
                              : !mapped && stream.stored_bytes < raw && stream.stored_bytes > 0 &&
                                    (stream.filter == Filter::none ||
                                     (!stream.zstd && stream.stored_bytes >= kPlaneEntryBytes * plane_count(filter)));
    if (!possible)
        return broken("17.4.3", at, field.name + ": stored size is impossible for the raw size",
                      is_raw || mapped ? std::to_string(raw) : "less than " + std::to_string(raw), stream.stored_bytes);
    if (raw / kMaxExpansion > stream.stored_bytes)
        return broken("17.4.4", at, field.name + ": expands more than 32,768 times",
                      "at least " + std::to_string(raw / kMaxExpansion) + " bytes", stream.stored_bytes);
    return {};
}

} // namespace

Result<FieldDirectory> decode_field_directory(ByteView bytes, const LevelDirectory &level,
                                              std::span<const Field> fields, const SectionEntry &values) {
    if (bytes.size() / (kFieldEntryBytes * fields.size()) != level.chunks.size() ||
        bytes.size() % (kFieldEntryBytes * fields.size()) != 0)
        return broken("17.4.1", 0, "the directory of the fields has not one entry per chunk and field",
                      level.chunks.size() * fields.size() * kFieldEntryBytes, bytes.size());
    FieldDirectory directory{.entries = {}, .fields = fields.size()};
    directory.entries.reserve(level.chunks.size() * fields.size());
    ByteReader in(bytes);
    std::uint64_t stored = 0, raw = 0;
    for (const ChunkEntry &chunk : level.chunks)
        for (const Field &field : fields) {
            const std::uint64_t at = in.offset();
            FieldEntry &entry = directory.entries.emplace_back();
            entry.hash = in.u64();
            entry.stream = unpack_stream_entry(in.u32());
            entry.offset = values.offset + stored;
            const std::uint64_t raw_here = std::uint64_t{chunk.shape.points} * field.bytes;
            if (const Status status = check_entry(entry, field, raw_here, values.codec == Codec::raw, at + 8); !status)
                return status.error();
            stored += entry.stream.stored_bytes;
            raw += raw_here;
        }
    if (stored != values.stored_bytes || raw != values.raw_bytes || level.points != values.count)
        return broken("17.4.5", bytes.size(), "sums over the fields of all chunks are not those of the section table",
                      std::to_string(values.stored_bytes) + " stored bytes, " + std::to_string(values.raw_bytes) +
                          " raw, " + std::to_string(values.count) + " points",
                      std::to_string(stored) + " stored bytes, " + std::to_string(raw) + " raw, " +
                          std::to_string(level.points) + " points");
    return directory;
}

Bytes encode_field_directory(const FieldDirectory &directory) {
    ByteWriter out;
    for (const FieldEntry &entry : directory.entries) {
        out.u64(entry.hash);
        out.u32(pack_stream_entry(entry.stream));
    }
    return out.take();
}

} // namespace pbm
