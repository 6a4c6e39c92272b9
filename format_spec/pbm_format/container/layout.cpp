#include "pbm_format/container/layout.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

namespace {

constexpr std::array kSections{
    SectionTraits{.type = SectionType::metadata, .name = "metadata"},
    SectionTraits{.type = SectionType::grid, .name = "grid"},
    SectionTraits{.type = SectionType::attributes, .name = "attributes"},
    SectionTraits{.type = SectionType::materials, .name = "materials"},
    SectionTraits{.type = SectionType::lights, .name = "lights"},
    SectionTraits{.type = SectionType::texture, .name = "texture"},
    SectionTraits{.type = SectionType::ground_plane, .name = "ground plane"},
    SectionTraits{.type = SectionType::fields, .name = "fields", .is_optional = true},
    SectionTraits{.type = SectionType::shapes, .name = "shapes", .is_optional = true},
    SectionTraits{.type = SectionType::level_directory, .name = "directory", .is_of_level = true},
    SectionTraits{.type = SectionType::level_chunks,
                  .name = "chunks",
                  .is_of_level = true,
                  .is_coded = true,
                  .mapped_alignment = kMappedChunksAlignment},
    SectionTraits{.type = SectionType::level_bricks,
                  .name = "bricks",
                  .is_of_level = true,
                  .mapped_alignment = kMappedStreamAlignment},
    SectionTraits{.type = SectionType::ground_texture,
                  .name = "ground texture",
                  .is_coded = true,
                  .is_raster = true,
                  .mapped_alignment = kMappedStreamAlignment},
    SectionTraits{.type = SectionType::ground_lit,
                  .name = "ground light",
                  .is_coded = true,
                  .is_raster = true,
                  .mapped_alignment = kMappedStreamAlignment},
    SectionTraits{.type = SectionType::panorama,
                  .name = "panorama",
                  .is_coded = true,
                  .is_raster = true,
                  .mapped_alignment = kMappedStreamAlignment},
    SectionTraits{
        .type = SectionType::field_directory, .name = "field directory", .is_of_level = true, .is_optional = true},
    SectionTraits{.type = SectionType::field_values,
                  .name = "field values",
                  .is_of_level = true,
                  .is_coded = true,
                  .is_optional = true},
    SectionTraits{.type = SectionType::stream_directory,
                  .name = "point stream directory",
                  .is_point_stream = true,
                  .is_optional = true},
    SectionTraits{.type = SectionType::stream_values,
                  .name = "point stream values",
                  .is_point_stream = true,
                  .is_coded = true,
                  .is_optional = true},
};

} // namespace

const SectionTraits *traits_of(SectionType type) {
    const auto *const found = std::find_if(kSections.begin(), kSections.end(),
                                           [&](const SectionTraits &traits) { return traits.type == type; });
    return found == kSections.end() ? nullptr : found;
}

std::string_view to_string(SectionType type) {
    const SectionTraits *const traits = traits_of(type);
    return traits == nullptr ? SectionTraits().name : traits->name;
}

std::string_view to_string(Storage storage) { return storage == Storage::mapped ? "mapped" : "packed"; }

namespace {

// Guesses the format of a file that is not .pbvg, for the message.
std::string describe_magic(ByteView file) {
    const std::string_view text(reinterpret_cast<const char *>(file.data()), file.size());
    const auto starts = [&](std::string_view magic) { return text.starts_with(magic); };
    if (file.empty())
        return "the file is empty";
    if (starts("P1") || starts("P4"))
        return "this is a Netpbm bitmap, not a binary voxel grid (.pbvg)";
    if (starts("ply"))
        return "this is a PLY file: turn it into a .pbvg with pbm-build first";
    if (starts("solid") || starts("OFF"))
        return "this is a mesh: turn it into a .pbvg with pbm-build first";
    if (starts("\x89"
               "BVG"))
        return "the file was damaged by a text-mode transfer";
    // Easy3D's Binary Vertex Group has no magic number: a number of points, then three floats per point.
    const std::uint64_t points = ByteReader(file).u32();
    if (points > 0 && 4 + 12 * points <= file.size())
        return "not a binary voxel grid (.pbvg); if this is a Binary Vertex Group (.bvg) of Easy3D, Mapple or PolyFit, "
               "export it there as PLY";
    return "not a binary voxel grid (.pbvg)";
}

std::string hex(ByteView bytes) {
    constexpr std::string_view kHexDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : bytes) {
        text += text.empty() ? "" : " ";
        text += kHexDigits[byte >> 4];
        text += kHexDigits[byte & 15];
    }
    return text;
}

std::string version(unsigned major, unsigned minor) { return std::to_string(major) + "." + std::to_string(minor); }

// Advice on an unsupported version, for the message.
std::string describe_version(unsigned major, const std::string &version) {
    if (major == 0)
        return "format version " + version + ", a draft: build the model again from its scan";
    return "format version " + version + ": this program reads 1.x, a newer one is needed";
}

} // namespace

Result<FileHeader> decode_header(ByteView start, std::uint64_t file_size) {
    const std::size_t magic_bytes = std::min(start.size(), kMagic.size());
    if (start.empty() ||
        !std::equal(kMagic.begin(), kMagic.begin() + static_cast<std::ptrdiff_t>(magic_bytes), start.begin()))
        return broken("2.1", 0, describe_magic(start), hex(kMagic),
                      start.empty() ? Value() : Value(hex(start.first(magic_bytes))));
    if (start.size() < kHeaderBytes)
        return broken("2.2", start.size(), "the file ends inside its header", kHeaderBytes, start.size());
    ByteReader in(start.first(kHeaderBytes));
    in.u64(); // magic
    FileHeader header;
    header.major = in.u16();
    header.minor = in.u16();
    header.endian = in.u32();
    header.file_size = in.u64();
    header.table_offset = in.u64();
    header.table_count = in.u32();
    header.depth = in.u8();
    in.zeros(3);
    const bool clear_so_far = in.reserved_clear();
    header.required_features = in.u64();
    header.optional_features = in.u64();
    header.point_count = in.u64();
    header.raw_bytes = in.u64();
    header.content_id = {in.u64(), in.u64()};
    for (auto &byte : header.root.bytes)
        byte = in.u8();
    header.chunk_points = in.u32();
    in.zeros(4);
    header.table_hash = in.u64();
    const std::uint64_t stored_hash = in.u64();

    // Verify the hash first: a flipped bit in the version is damage, not a new version.
    if (const std::uint64_t hash = hash64(start.first(kHeaderBytes - 8)); stored_hash != hash)
        return broken("2.3", 0, "the header was changed: its hash does not match", hash_value(stored_hash),
                      hash_value(hash));
    if (header.endian != kEndianTag)
        return broken("2.4", 12, "the endian tag is not 0x01020304", kEndianTag, header.endian);
    // A later minor version adds only what may be ignored, or it sets a required feature bit (section 11).
    if (header.major != kMajorVersion) {
        const std::string found = version(header.major, header.minor);
        return broken("2.5", 8, describe_version(header.major, found), version(kMajorVersion, kMinorVersion), found);
    }
    if ((header.required_features & ~kMappedFeature) != 0)
        return broken("2.6", 40, "the file requires a feature this program does not know", kMappedFeature,
                      header.required_features);
    if (header.file_size > file_size)
        return broken("2.7", file_size,
                      "the file ends " + std::to_string(header.file_size - file_size) + " bytes early",
                      header.file_size, file_size);
    if (header.file_size < file_size) {
        Error error = broken("2.7", header.file_size, "bytes after the end of the file", header.file_size, file_size);
        error.code = ErrorCode::bad_header; // no byte is missing
        return error;
    }
    if (!in.reserved_clear())
        return broken("2.8", clear_so_far ? 108U : 37U, "reserved bytes are not zero", 0, in.reserved());
    if (header.depth < kMinDepth || header.depth > kMaxDepth)
        return broken("2.9", 36, "depth is not 2..16", "2..16", header.depth);
    if (header.point_count == 0 || header.point_count > kMaxPoints)
        return broken("2.10", 56, "point count is not 1..2^32-1", "1..4294967295", header.point_count);
    if (header.chunk_points < kMinChunkPoints || header.chunk_points > kDefaultChunkPoints ||
        !std::has_single_bit(header.chunk_points))
        return broken("2.11", 104, "chunk limit is not a power of two from 512 to 65,536", "a power of two, 512..65536",
                      header.chunk_points);
    if (header.table_offset != kHeaderBytes)
        return broken("2.12", 24, "the section table does not follow the header", kHeaderBytes, header.table_offset);
    return header;
}

std::array<std::uint32_t, 3> SectionEntry::order() const {
    constexpr auto kLevels = static_cast<std::uint32_t>(SectionType::level_directory);
    switch (type) {
    case SectionType::level_directory: return {kLevels, instance, 0};
    case SectionType::level_bricks: return {kLevels, instance, 1};
    case SectionType::level_chunks: return {kLevels, instance, 2};
    default: return {static_cast<std::uint32_t>(type), instance, 0};
    }
}

namespace {

// Name of an entry's section, "chunks 3".
std::string place_name(const SectionEntry &entry) {
    return (is_known(entry.type) ? std::string(to_string(entry.type))
                                 : "type " + std::to_string(static_cast<std::uint32_t>(entry.type))) +
           " " + std::to_string(entry.instance);
}

// 3.2.15, 3.2.16
Status check_storage(const SectionEntry &entry, const SectionTraits &traits, Storage storage, std::uint64_t at) {
    if (storage == Storage::packed)
        return entry.type == SectionType::level_bricks
                   ? broken("3.2.15", at, "bricks in a file that is not mapped", "mapped", "packed")
                   : Status{};
    if (traits.mapped_alignment != 0 && entry.alignment != traits.mapped_alignment)
        return broken("3.2.16", at + 16, std::string(traits.name) + ": not the alignment of a mapped file",
                      traits.mapped_alignment, entry.alignment);
    return {};
}

// 3.2.7
Status check_instance(const SectionEntry &entry, const SectionTraits &traits, int depth, std::uint64_t at) {
    if (traits.is_point_stream) {
        const std::uint32_t kind = entry.instance / kStreamKinds, level = entry.instance % kStreamKinds;
        if (kind >= 1 && kind < kStreamKinds && level >= 1 && level <= static_cast<std::uint32_t>(depth))
            return {};
        return broken("3.2.7", at + 8, std::string(traits.name) + ": no such instance",
                      "256 x kind + 1.." + std::to_string(depth), entry.instance);
    }
    const std::uint32_t first = traits.is_of_level ? 1 : 0;
    const std::uint32_t last = traits.is_of_level                      ? static_cast<std::uint32_t>(depth)
                               : entry.type == SectionType::ground_lit ? kMaxLights - 1
                                                                       : 0;
    if (entry.instance >= first && entry.instance <= last)
        return {};
    return broken("3.2.7", at + 8, std::string(traits.name) + ": no such instance",
                  first == last ? std::to_string(first) : std::to_string(first) + ".." + std::to_string(last),
                  entry.instance);
}

// Rules of one entry that depend only on the entry and the header.
Status check_entry(const SectionEntry &entry, const FileHeader &header, std::uint64_t at) {
    const SectionTraits *const known = traits_of(entry.type);
    const SectionTraits traits = known == nullptr ? SectionTraits() : *known;
    const std::string name(traits.name);
    const Codec codec = traits.is_coded && header.storage() == Storage::packed ? Codec::zstd_chunks : Codec::raw;
    const bool is_critical = (entry.flags & kCriticalFlag) != 0;
    if (known == nullptr && is_critical)
        return broken("3.2.4", at, "a critical section of a type this program does not know", "a known type",
                      static_cast<std::uint32_t>(entry.type));
    if (known != nullptr && entry.codec != codec)
        return broken("3.2.5", at + 4,
                      name + ": codec unknown to this program, or not that of a " +
                          std::string(to_string(header.storage())) + " file",
                      static_cast<std::uint16_t>(codec), static_cast<std::uint16_t>(entry.codec));
    if ((entry.flags & ~kCriticalFlag) != 0)
        return broken("3.2.6", at + 6, name + ": unknown flag", "0..1", entry.flags);
    if (traits.is_optional && is_critical)
        return traits.is_point_stream
                   ? broken("19.1.1", at + 6, name + ": critical, so that earlier readers refuse it", 0, entry.flags)
               : entry.type == SectionType::shapes
                   ? broken("18.1.1", at + 6, name + ": critical, so that earlier readers refuse it", 0, entry.flags)
                   : broken("17.1.3", at + 6, name + ": a critical section, which readers of version 1.0 refuse", 0,
                            entry.flags);
    if (known != nullptr)
        if (Status status = check_instance(entry, traits, header.depth, at); !status)
            return status;
    if (!std::has_single_bit(entry.alignment) || entry.alignment < kSectionAlignment || entry.alignment > 65536)
        return broken("3.2.8", at + 16, name + ": alignment is not a power of two from 8 to 65,536",
                      "a power of two, 8..65536", entry.alignment);
    if (entry.codec == Codec::raw && entry.raw_bytes != entry.stored_bytes)
        return broken("3.2.9", at + 40, name + ": raw section whose sizes differ", entry.stored_bytes, entry.raw_bytes);
    if (entry.raw_bytes / kMaxExpansion > entry.stored_bytes)
        return broken("3.2.10", at + 40, name + ": expands more than 32,768 times",
                      "less than 32768 x (" + std::to_string(entry.stored_bytes) + " + 1)", entry.raw_bytes);
    const bool counted = entry.element_bytes > 0 && entry.raw_bytes % entry.element_bytes == 0 &&
                         entry.raw_bytes / entry.element_bytes == entry.count;
    if (known != nullptr && (traits.is_coded ? entry.element_bytes != 0 : !counted))
        return broken("3.2.13", at + 12, name + ": element size and count do not give the raw size",
                      traits.is_coded ? Value(0) : Value(entry.raw_bytes),
                      traits.is_coded
                          ? Value(entry.element_bytes)
                          : Value(std::to_string(entry.element_bytes) + " x " + std::to_string(entry.count)));
    return known == nullptr ? Status() : check_storage(entry, traits, header.storage(), at);
}

// 17.1.1
Status check_field_sections(std::span<const SectionEntry> entries, const FileHeader &header) {
    const bool wanted = find_section(entries, SectionType::fields) != nullptr;
    for (std::uint32_t level = 1; level <= header.depth; ++level)
        for (const SectionType type : {SectionType::field_directory, SectionType::field_values})
            if ((find_section(entries, type, level) != nullptr) != wanted)
                return broken("17.1.1", kHeaderBytes,
                              "fields need their " + std::string(to_string(type)) +
                                  " of each level and the fields section: not so at level " + std::to_string(level));
    return {};
}

// 19.1.2
Status check_stream_sections(std::span<const SectionEntry> entries) {
    for (const SectionEntry &entry : entries) {
        const bool is_directory = entry.type == SectionType::stream_directory;
        if (!is_directory && entry.type != SectionType::stream_values)
            continue;
        const SectionType other = is_directory ? SectionType::stream_values : SectionType::stream_directory;
        if (find_section(entries, other, entry.instance) == nullptr)
            return broken("19.1.2", kHeaderBytes,
                          "a " + std::string(to_string(entry.type)) + " section without " +
                              std::string(to_string(other)) + ": instance " + std::to_string(entry.instance));
    }
    return {};
}

} // namespace

Result<std::vector<SectionEntry>> decode_section_table(ByteView start, const FileHeader &header) {
    if (header.table_count == 0 || header.table_count > kMaxSections)
        return broken("3.1.1", 32, "section count is not 1..256", "1..256", header.table_count);
    const std::uint64_t table_bytes = header.table_count * kSectionEntryBytes;
    if (table_bytes > header.file_size - kHeaderBytes)
        return broken("3.1.2", header.file_size, "the section table is cut short", kHeaderBytes + table_bytes,
                      header.file_size);
    const ByteView table = slice(start, kHeaderBytes, table_bytes);
    if (const std::uint64_t hash = hash64(table); hash != header.table_hash)
        return broken("3.1.3", kHeaderBytes, "the section table was changed: its hash does not match",
                      hash_value(header.table_hash), hash_value(hash));

    ByteReader in(table);
    std::vector<SectionEntry> entries;
    entries.reserve(header.table_count);
    std::uint64_t end = kHeaderBytes + table_bytes; // of the previous section
    std::uint64_t raw_bytes = 0;
    for (std::uint32_t i = 0; i < header.table_count; ++i) {
        const std::uint64_t at = kHeaderBytes + in.offset();
        SectionEntry entry;
        entry.type = SectionType{in.u32()};
        entry.codec = Codec{in.u16()};
        entry.flags = in.u16();
        entry.instance = in.u32();
        entry.element_bytes = in.u32();
        entry.alignment = in.u32();
        in.zeros(4);
        entry.offset = in.u64();
        entry.stored_bytes = in.u64();
        entry.raw_bytes = in.u64();
        entry.count = in.u64();
        entry.hash = in.u64();
        if (!in.reserved_clear())
            return broken("3.2.1", at + 20, "reserved bytes are not zero", 0, in.reserved());
        if (!entries.empty() && !(entries.back().order() < entry.order()))
            return broken("3.2.2", at, "sections are not in order, or one is there twice",
                          "after " + place_name(entries.back()), place_name(entry));
        if (const Status status = check_entry(entry, header, at); !status)
            return status.error();
        const std::uint64_t expected = (end + entry.alignment - 1) / entry.alignment * entry.alignment;
        if (entry.offset != expected)
            return broken("3.2.3", at + 24, "a section does not follow the one before at its alignment", expected,
                          entry.offset);
        if (entry.offset > header.file_size || entry.stored_bytes > header.file_size - entry.offset)
            return broken("3.2.11", header.file_size, "a section lies outside the file",
                          "at most " + std::to_string(header.file_size - std::min(entry.offset, header.file_size)) +
                              " bytes",
                          entry.stored_bytes);
        end = entry.offset + entry.stored_bytes;
        if (entry.raw_bytes > ~raw_bytes)
            return broken("3.1.4", at + 40, "sizes overflow", "at most " + std::to_string(~raw_bytes), entry.raw_bytes);
        raw_bytes += entry.raw_bytes;
        entries.push_back(entry);
    }
    if (end != header.file_size)
        return broken("3.1.5", end, "bytes after the last section", header.file_size, end);
    if (raw_bytes != header.raw_bytes)
        return broken("3.1.6", 64, "the header's raw size is not the sum of the sections'", raw_bytes,
                      header.raw_bytes);

    for (const SectionType type :
         {SectionType::metadata, SectionType::grid, SectionType::attributes, SectionType::materials})
        if (find_section(entries, type) == nullptr)
            return broken("3.1.7", kHeaderBytes, "no " + std::string(to_string(type)) + " section");
    for (std::uint32_t level = 1; level <= header.depth; ++level)
        for (const SectionType type :
             {SectionType::level_directory, SectionType::level_bricks, SectionType::level_chunks})
            if (find_section(entries, type, level) == nullptr &&
                (type != SectionType::level_bricks || header.storage() == Storage::mapped))
                return broken("3.1.8", kHeaderBytes,
                              "no " + std::string(to_string(type)) + " for level " + std::to_string(level));
    if (const Status status = check_field_sections(entries, header); !status)
        return status.error();
    if (const Status status = check_stream_sections(entries); !status)
        return status.error();
    return entries;
}

const SectionEntry *find_section(std::span<const SectionEntry> sections, SectionType type, std::uint32_t instance) {
    const auto found = std::find_if(sections.begin(), sections.end(), [&](const SectionEntry &entry) {
        return entry.type == type && entry.instance == instance;
    });
    return found == sections.end() ? nullptr : &*found;
}

} // namespace pbm
