#include "file_parts.h"

#include "pbm_format/container/section_encoder.h"
#include "pbm_format/rasters/image_section.h"
#include "unit/support/file_editor.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <cstring>

namespace pbm::faults {
namespace {

std::uint32_t u32_at(const Bytes &bytes, std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

// Replaces bytes [begin, begin + size) of `bytes` by `stored`.
void splice(Bytes &bytes, std::size_t begin, std::size_t size, ByteView stored) {
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(begin);
    bytes.insert(bytes.erase(at, at + static_cast<std::ptrdiff_t>(size)), stored.begin(), stored.end());
}

void set_entry(Bytes &bytes, std::size_t at, std::size_t size, std::uint32_t coding) {
    const std::uint32_t entry = static_cast<std::uint32_t>(size) | coding << 24;
    std::memcpy(bytes.data() + at, &entry, sizeof entry);
}

} // namespace

FileParts::FileParts(ByteView valid_file) : header(value_of(decode_header(valid_file))) {
    const std::vector<SectionEntry> entries = value_of(decode_section_table(valid_file, header));
    for (const SectionEntry &entry : entries) {
        const ByteView stored = valid_file.subspan(entry.offset, entry.stored_bytes);
        sections.push_back({entry, Bytes(stored.begin(), stored.end())});
    }
}

FileParts::Section &FileParts::section(SectionType type, std::uint32_t instance) {
    return *std::find_if(sections.begin(), sections.end(), [&](const Section &section) {
        return section.entry.type == type && section.entry.instance == instance;
    });
}

Bytes FileParts::assemble() const {
    FileHeader made = header;
    std::vector<SectionEntry> entries;
    made.table_count = static_cast<std::uint32_t>(sections.size());
    made.raw_bytes = 0;
    std::uint64_t end = kHeaderBytes + sections.size() * kSectionEntryBytes;
    for (const Section &section : sections) {
        SectionEntry entry = section.entry;
        entry.offset = end = (end + entry.alignment - 1) / entry.alignment * entry.alignment;
        entry.stored_bytes = section.bytes.size();
        if (entry.codec == Codec::raw)
            entry.raw_bytes = entry.stored_bytes;
        if (entry.codec == Codec::raw && entry.element_bytes > 0)
            entry.count = entry.raw_bytes / entry.element_bytes;
        made.raw_bytes += entry.raw_bytes;
        end += entry.stored_bytes;
        entries.push_back(entry);
    }
    made.file_size = end;
    Bytes file = encode_header(made);
    const Bytes table = encode_section_table(entries);
    file.insert(file.end(), table.begin(), table.end());
    for (std::size_t i = 0; i < sections.size(); ++i) {
        file.resize(entries[i].offset, 0);
        file.insert(file.end(), sections[i].bytes.begin(), sections[i].bytes.end());
    }
    test::FileEditor editor(std::move(file));
    editor.repair();
    return std::move(editor.bytes());
}

void replace_stream(FileParts &file, int level, std::size_t chunk, std::size_t stream, ByteView stored,
                    std::uint32_t coding) {
    FileParts::Section &directory = file.section(SectionType::level_directory, static_cast<std::uint32_t>(level));
    FileParts::Section &chunks = file.section(SectionType::level_chunks, static_cast<std::uint32_t>(level));
    const std::size_t entry_bytes = directory.entry.element_bytes;
    const std::size_t wanted = chunk * entry_bytes + kChunkEntryFixedBytes + 4 * stream;
    std::size_t at = 0;
    for (std::size_t entry = 0; entry <= chunk; ++entry)
        for (std::size_t s = entry * entry_bytes + kChunkEntryFixedBytes; s < (entry + 1) * entry_bytes; s += 4) {
            const std::size_t size = u32_at(directory.bytes, s) & 0xFFFFFF;
            if (s == wanted) {
                splice(chunks.bytes, at, size, stored);
                return set_entry(directory.bytes, s, stored.size(), coding);
            }
            at += size;
        }
}

void replace_tile(FileParts &file, SectionType type, std::size_t tile, ByteView stored, std::uint32_t coding) {
    constexpr std::size_t kHead = 32, kEntry = 16;
    Bytes &bytes = file.section(type).bytes;
    std::size_t at = kHead + kEntry * u32_at(bytes, 16);
    for (std::size_t i = 0; i < tile; ++i)
        at += u32_at(bytes, kHead + kEntry * i + 8) & 0xFFFFFF;
    const std::size_t entry = kHead + kEntry * tile + 8;
    splice(bytes, at, u32_at(bytes, entry) & 0xFFFFFF, stored);
    set_entry(bytes, entry, stored.size(), coding);
}

} // namespace pbm::faults
