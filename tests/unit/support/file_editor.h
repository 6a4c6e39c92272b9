// Damages .pbvg files: edits fields in place and repairs every hash that covers them, so that the file violates the
// rule and not only the hash.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/hashes/hash.h"

#include <cstring>
#include <utility>

namespace pbm::test {

class FileEditor {
  public:
    explicit FileEditor(Bytes file) : file_(std::move(file)) {}

    template <class T> T get(std::size_t at) const {
        T value{};
        if (at <= file_.size() && sizeof(T) <= file_.size() - at)
            std::memcpy(&value, file_.data() + at, sizeof(T));
        return value;
    }
    template <class T> void set(std::size_t at, T value) {
        if (at <= file_.size() && sizeof(T) <= file_.size() - at)
            std::memcpy(file_.data() + at, &value, sizeof(T));
    }
    void flip(std::uint64_t bit) { file_[bit / 8] = static_cast<std::uint8_t>(file_[bit / 8] ^ 1U << bit % 8); }

    // Offset of a section's entry in the table, and of the section itself.
    std::size_t entry(SectionType type, std::uint32_t instance = 0) const {
        std::size_t at = kHeaderBytes;
        while (get<std::uint32_t>(at) != static_cast<std::uint32_t>(type) || get<std::uint32_t>(at + 8) != instance)
            at += kSectionEntryBytes;
        return at;
    }
    std::size_t section(SectionType type, std::uint32_t instance = 0) const {
        return get<std::uint64_t>(entry(type, instance) + 24);
    }
    // Offset of the entry of chunk `index` in its level's directory.
    std::size_t chunk(std::uint32_t level, std::size_t index = 0) const {
        const std::size_t entry_at = entry(SectionType::level_directory, level);
        return get<std::uint64_t>(entry_at + 24) + index * get<std::uint32_t>(entry_at + 12);
    }

    // Removes the last `bytes` (a multiple of 8) of a raw section and moves the sections after it. `record`: the new
    // element size.
    void shorten(SectionType type, std::uint32_t instance, std::uint64_t bytes, std::uint32_t record) {
        const std::size_t at = entry(type, instance);
        const std::uint64_t size = get<std::uint64_t>(at + 32) - bytes;
        const std::size_t end = get<std::uint64_t>(at + 24) + size;
        file_.erase(file_.begin() + static_cast<std::ptrdiff_t>(end),
                    file_.begin() + static_cast<std::ptrdiff_t>(end + bytes));
        set<std::uint32_t>(at + 12, record);
        set<std::uint64_t>(at + 32, size);
        set<std::uint64_t>(at + 40, size);
        set<std::uint64_t>(at + 48, size / record);
        for (std::size_t next = at + kSectionEntryBytes;
             next < kHeaderBytes + get<std::uint32_t>(32) * kSectionEntryBytes; next += kSectionEntryBytes)
            set<std::uint64_t>(next + 24, get<std::uint64_t>(next + 24) - bytes);
        set<std::uint64_t>(16, get<std::uint64_t>(16) - bytes);
        set<std::uint64_t>(64, get<std::uint64_t>(64) - bytes);
    }

    // Appends `bytes` (a multiple of 8) bytes of value `fill` to a raw section of one-byte elements and moves the
    // sections after it.
    void lengthen(SectionType type, std::uint32_t instance, std::uint64_t bytes, std::uint8_t fill) {
        const std::size_t at = entry(type, instance);
        const std::uint64_t size = get<std::uint64_t>(at + 32);
        file_.insert(file_.begin() + static_cast<std::ptrdiff_t>(get<std::uint64_t>(at + 24) + size),
                     static_cast<std::size_t>(bytes), fill);
        for (const std::size_t field : {at + 32, at + 40, at + 48, std::size_t{16}, std::size_t{64}})
            set<std::uint64_t>(field, get<std::uint64_t>(field) + bytes);
        for (std::size_t next = at + kSectionEntryBytes;
             next < kHeaderBytes + get<std::uint32_t>(32) * kSectionEntryBytes; next += kSectionEntryBytes)
            set<std::uint64_t>(next + 24, get<std::uint64_t>(next + 24) + bytes);
    }

    // Repairs the hashes of sections, table and header, and with `chunks` those of chunks and tiles. Skips parts that
    // lie outside the file.
    void repair(bool chunks = true) {
        const std::uint64_t most = file_.size() < kHeaderBytes ? 0 : (file_.size() - kHeaderBytes) / kSectionEntryBytes;
        const std::uint64_t count = std::min<std::uint64_t>(get<std::uint32_t>(32), most);
        for (std::uint64_t i = 0; chunks && i < count; ++i) {
            repair_chunks(kHeaderBytes + i * kSectionEntryBytes);
            repair_tiles(kHeaderBytes + i * kSectionEntryBytes);
            repair_values(kHeaderBytes + i * kSectionEntryBytes, SectionType::field_directory,
                          SectionType::field_values, 12);
            repair_values(kHeaderBytes + i * kSectionEntryBytes, SectionType::stream_directory,
                          SectionType::stream_values, 16);
        }
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::size_t at = kHeaderBytes + i * kSectionEntryBytes;
            const ByteView stored = part(get<std::uint64_t>(at + 24), get<std::uint64_t>(at + 32));
            set(at + 56, hash64(stored));
        }
        if (file_.size() < kHeaderBytes)
            return;
        set(112, hash64(part(kHeaderBytes, get<std::uint32_t>(32) * kSectionEntryBytes)));
        set(120, hash64(part(0, 120)));
    }

    Bytes &bytes() { return file_; }

  private:
    ByteView part(std::uint64_t offset, std::uint64_t size) const {
        if (offset > file_.size() || size > file_.size() - offset)
            return {};
        return ByteView(file_).subspan(offset, size);
    }

    void repair_chunks(std::size_t directory_entry) {
        const std::uint32_t entry_bytes = get<std::uint32_t>(directory_entry + 12);
        if (get<std::uint32_t>(directory_entry) != static_cast<std::uint32_t>(SectionType::level_directory) ||
            entry_bytes <= kChunkEntryFixedBytes)
            return;
        const ByteView directory =
            part(get<std::uint64_t>(directory_entry + 24), get<std::uint64_t>(directory_entry + 32));
        const std::size_t directory_at = get<std::uint64_t>(directory_entry + 24);
        // Chunks follow the directory, or in mapped files its bricks.
        const std::size_t next = directory_entry + kSectionEntryBytes;
        const bool mapped = get<std::uint32_t>(next) == static_cast<std::uint32_t>(SectionType::level_bricks);
        std::uint64_t at = get<std::uint64_t>(next + (mapped ? kSectionEntryBytes : 0) + 24);
        for (std::size_t i = 0; i + entry_bytes <= directory.size(); i += entry_bytes) {
            std::uint64_t stored = 0;
            for (std::size_t s = kChunkEntryFixedBytes; s < entry_bytes; s += 4) {
                stored += get<std::uint32_t>(directory_at + i + s) & 0xFFFFFF;
                if (mapped)
                    stored = align_stream(stored);
            }
            set(directory_at + i + 8, hash64(part(at, stored)));
            at += stored;
        }
    }

    void repair_tiles(std::size_t section_entry) {
        const std::size_t at = get<std::uint64_t>(section_entry + 24);
        const ByteView section = part(at, get<std::uint64_t>(section_entry + 32));
        if (!is_raster(SectionType{get<std::uint32_t>(section_entry)}) || section.size() < 32)
            return;
        const std::uint64_t tiles = std::min<std::uint64_t>(get<std::uint32_t>(at + 16), (section.size() - 32) / 16);
        const std::uint64_t directory_bytes = 32 + 16 * tiles;
        const bool mapped = get<std::uint16_t>(at + 20) == kMappedStreamAlignment;
        std::uint64_t end = at + directory_bytes;
        for (std::size_t tile = at + 32; tile < at + directory_bytes; tile += 16) {
            end = mapped ? align_stream(end) : end; // raster sections are aligned like their tiles
            const std::uint64_t stored = get<std::uint32_t>(tile + 8) & 0xFFFFFF;
            set(tile, hash64(part(end, stored)));
            end += stored;
        }
        set(at, hash64(part(at + 8, directory_bytes - 8)));
    }

    // Of a directory of fields or of a point stream; the values have the same instance.
    void repair_values(std::size_t directory_entry, SectionType type, SectionType of_values, std::size_t entry_bytes) {
        if (get<std::uint32_t>(directory_entry) != static_cast<std::uint32_t>(type))
            return;
        const std::size_t directory = get<std::uint64_t>(directory_entry + 24);
        const std::size_t entries = get<std::uint64_t>(directory_entry + 32) / entry_bytes;
        std::uint64_t at = 0;
        for (std::size_t entry = kHeaderBytes; at == 0 && entry < file_.size(); entry += kSectionEntryBytes)
            if (get<std::uint32_t>(entry) == static_cast<std::uint32_t>(of_values) &&
                get<std::uint32_t>(entry + 8) == get<std::uint32_t>(directory_entry + 8))
                at = get<std::uint64_t>(entry + 24);
        for (std::size_t i = 0; i < entries && directory + i * entry_bytes < file_.size(); ++i) {
            const std::uint64_t stored = get<std::uint32_t>(directory + i * entry_bytes + 8) & 0xFFFFFF;
            set(directory + i * entry_bytes, hash64(part(at, stored)));
            at += stored;
        }
    }

    Bytes file_;
};

} // namespace pbm::test
