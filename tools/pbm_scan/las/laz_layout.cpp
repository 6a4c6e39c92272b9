#include "pbm_scan/las/laz_layout.h"

#include "pbm_scan/las/arithmetic_decoder.h"
#include "pbm_scan/las/laz_point14.h"
#include "pbm_scan/surface/refusal.h"

#include <optional>
#include <string>
#include <utility>

namespace pbm::build {
namespace {

// The items that a point format must have, in this order.
std::vector<LazItem> items_of(const LasHeader &header) {
    const PointFormat &format = *header.format;
    std::vector<LazItem> items;
    std::size_t offset = 0;
    const auto add = [&](LazField field, std::size_t size) {
        items.push_back({.field = field, .size = size, .offset = offset});
        offset += size;
    };
    if (format.is_new)
        add(LazField::point14, 30);
    else
        add(LazField::point10, 20);
    if (!format.is_new && format.time != 0)
        add(LazField::time11, 8);
    if (format.infrared != 0)
        add(LazField::colour_infrared14, 8);
    else if (format.colour != 0)
        add(format.is_new ? LazField::colour14 : LazField::colour12, 6);
    if (format.wave != 0)
        add(format.is_new ? LazField::wave14 : LazField::wave13, 29);
    if (header.stride > offset)
        add(format.is_new ? LazField::bytes14 : LazField::bytes, header.stride - offset);
    return items;
}

bool is_known(const LazItem &item, bool is_layered) {
    constexpr unsigned kPrototype = 2; // of version 3
    if (is_layered)
        return item.version >= kPrototype && item.version <= 4;
    return item.version == 1 || item.version == 2;
}

using Chunks = std::vector<LazChunk>;

constexpr std::size_t kOffsetSize = 8; // of the table, before the first chunk

// Nothing if the writer was interrupted before it wrote the table. Chunks have kVariable points where the table does
// not say it.
Result<std::optional<Chunks>> read_table(ByteView file, const LasHeader &header, const LazLayout &layout) {
    constexpr std::size_t kTableHeader = 8;
    const std::uint64_t first = header.first;
    if (file.size() - first < kOffsetSize)
        return bad_input("the file ends before its first point", file.size());
    std::uint64_t at = load<std::uint64_t>(file.data() + first);
    if (at == first)
        return std::optional<Chunks>();
    if (at == ~std::uint64_t{0}) // the writer could not go back
        at = load<std::uint64_t>(file.data() + file.size() - kOffsetSize);
    if (at < first + kOffsetSize || at > file.size() || file.size() - at < kTableHeader)
        return bad_input("the table of chunks begins at byte " + std::to_string(at) + " of " +
                             std::to_string(file.size()) + ": the file is cut short or damaged",
                         first);
    const auto version = load<std::uint32_t>(file.data() + at), count = load<std::uint32_t>(file.data() + at + 4);
    if (version != 0)
        return bad_input("version " + std::to_string(version) + " of the table of chunks is not known", at);
    LazChunk chunk{.offset = first + kOffsetSize, .points = layout.chunk_points};
    if (count > (at - chunk.offset) / header.stride)
        return bad_input("the table announces " + std::to_string(count) + " chunks in " +
                             std::to_string(at - chunk.offset) + " bytes",
                         at + 4);
    const bool is_variable = layout.chunk_points == LazLayout::kVariable;
    ArithmeticDecoder in(file.subspan(static_cast<std::size_t>(at) + kTableHeader));
    IntegerDecoder<32, 2> decoder;
    std::uint32_t points = 0, bytes = 0;
    Chunks chunks;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (is_variable)
            chunk.points = points = decoder.next(in, points, 0);
        chunk.bytes = bytes = decoder.next(in, bytes, 1);
        if (in.is_damaged() || chunk.bytes < header.stride || chunk.bytes > at - chunk.offset || chunk.points == 0)
            return bad_input("the table of chunks is damaged at chunk " + std::to_string(i), at);
        chunks.push_back(chunk);
        chunk.offset += chunk.bytes;
    }
    if (chunk.offset != at)
        return bad_input("the chunks end at byte " + std::to_string(chunk.offset) + ", their table begins at " +
                             std::to_string(at),
                         at);
    return std::optional(std::move(chunks));
}

Error of_chunk(const Error &error, std::size_t number, std::uint64_t offset) {
    return bad_input("chunk " + std::to_string(number) + ": " + error.message, offset + error.offset);
}

// Layered chunks say themselves how many points they have.
Status measure_chunks(ByteView file, const LazLayout &layout, Chunks &chunks) {
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        LazChunk &chunk = chunks[i];
        const Result<LayeredChunk> measured = measure_layered(slice(file, chunk.offset, chunk.bytes), layout);
        if (!measured)
            return of_chunk(measured.error(), i, chunk.offset);
        const bool is_variable = layout.chunk_points == LazLayout::kVariable;
        if (measured->bytes != chunk.bytes || measured->points > chunk.points ||
            (is_variable && measured->points != chunk.points))
            return bad_input("chunk " + std::to_string(i) + " has " + std::to_string(measured->points) + " points in " +
                                 std::to_string(measured->bytes) + " bytes, by the table of chunks " +
                                 std::to_string(chunk.points) + " in " + std::to_string(chunk.bytes),
                             chunk.offset);
        chunk.points = measured->points;
    }
    return {};
}

Result<Chunks> measure_without_table(ByteView file, const LasHeader &header, const LazLayout &layout) {
    Chunks chunks;
    std::uint64_t offset = header.first + kOffsetSize, points = 0;
    while (points < header.announced) {
        const Result<LayeredChunk> measured = measure_layered(file.subspan(static_cast<std::size_t>(offset)), layout);
        if (!measured)
            return of_chunk(measured.error(), chunks.size(), offset);
        chunks.push_back({.offset = offset, .bytes = measured->bytes, .points = measured->points});
        offset += measured->bytes;
        points += measured->points;
    }
    return chunks;
}

// The header's points in chunks of equal size. `chunks`: those of the table, without it those that must be there.
Status count_points(const LasHeader &header, const LazLayout &layout, bool has_table, Chunks &chunks) {
    const std::uint64_t each = layout.chunk_points, needed = header.announced / each + (header.announced % each != 0);
    if (!has_table)
        chunks.resize(static_cast<std::size_t>(needed), {.offset = header.first + kOffsetSize, .points = each});
    if (chunks.size() != needed)
        return bad_input("the file announces " + std::to_string(header.announced) + " points, which are " +
                             std::to_string(needed) + " chunks, and has " + std::to_string(chunks.size()) +
                             ": it is cut short or damaged",
                         107);
    if (needed != 0)
        chunks.back().points = header.announced - (needed - 1) * each;
    return {};
}

} // namespace

Result<LazLayout> read_laz_layout(const LasHeader &header) {
    ByteReader in(header.laz_record);
    const std::uint16_t compressor = in.u16(), coder = in.u16();
    in.u64(); // version of the writer, options
    LazLayout layout;
    layout.stride = header.stride;
    layout.chunk_points = in.u32();
    in.u64(), in.u64();
    const std::size_t count = in.u16();
    if (header.laz_record.empty() || !in.ok())
        return bad_input("the LAZ file has no whole record 'laszip encoded'", header.laz_offset);
    enum : std::uint8_t { pointwise = 1, pointwise_chunked = 2, layered_chunked = 3 };
    if (compressor < pointwise || compressor > layered_chunked)
        return unsupported("LAZ compressor " + std::to_string(compressor) + " is not known; unpack the file to LAS");
    if (coder != 0)
        return unsupported("LAZ coder " + std::to_string(coder) + " is not known; unpack the file to LAS");
    layout.is_chunked = compressor != pointwise;
    layout.is_layered = compressor == layered_chunked;
    layout.items = items_of(header);
    bool is_fitting = count == layout.items.size() && layout.is_layered == header.format->is_new;
    for (LazItem &item : layout.items) {
        is_fitting = is_fitting && in.u16() == static_cast<std::uint16_t>(item.field) && in.u16() == item.size;
        item.version = in.u16();
    }
    if (!is_fitting || !in.ok())
        return bad_input("the record 'laszip encoded' describes other points than those of the header",
                         header.laz_offset);
    for (const LazItem &item : layout.items)
        if (!is_known(item, layout.is_layered))
            return unsupported("version " + std::to_string(item.version) + " of the LAZ item " +
                               std::to_string(static_cast<unsigned>(item.field)) +
                               " is not known; unpack the file to LAS");
    if (layout.is_chunked && layout.chunk_points == 0)
        layout.chunk_points = LazLayout::kVariable;
    return layout;
}

Result<Chunks> find_laz_chunks(ByteView file, const LasHeader &header, const LazLayout &layout) {
    const bool is_variable = layout.is_chunked && layout.chunk_points == LazLayout::kVariable;
    if (!layout.is_layered && !is_variable && header.announced > max_laz_points(file.size(), layout))
        return bad_input("the file announces " + std::to_string(header.announced) + " points in " +
                             std::to_string(file.size()) + " bytes: it is cut short or damaged",
                         107);
    if (!layout.is_chunked)
        return header.announced == 0 ? Chunks{} : Chunks{{.offset = header.first, .points = header.announced}};
    Result<std::optional<Chunks>> table = read_table(file, header, layout);
    if (!table)
        return table.error();
    const bool has_table = table->has_value();
    if (!has_table && layout.is_layered)
        return measure_without_table(file, header, layout);
    if (!has_table && is_variable)
        return bad_input("the file has no table of chunks: its writer was interrupted; export it again", header.first);
    Chunks chunks = has_table ? std::move(**table) : Chunks{};
    Status good;
    if (layout.is_layered)
        good = measure_chunks(file, layout, chunks);
    else if (!is_variable)
        good = count_points(header, layout, has_table, chunks);
    if (!good)
        return good.error();
    return chunks;
}

} // namespace pbm::build
