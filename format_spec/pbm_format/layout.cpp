#include "pbm_format/layout.h"

#include <algorithm>

namespace pbm {

std::string_view to_string(SectionType type) {
    switch (type) {
    case SectionType::metadata: return "metadata";
    case SectionType::grid: return "grid";
    case SectionType::attributes: return "attributes";
    case SectionType::materials: return "materials";
    case SectionType::lights: return "lights";
    case SectionType::texture: return "texture";
    case SectionType::ground_plane: return "ground plane";
    case SectionType::level_directory: return "directory";
    case SectionType::level_chunks: return "chunks";
    case SectionType::level_bricks: return "bricks";
    case SectionType::ground_texture: return "ground texture";
    case SectionType::ground_lit: return "ground light";
    case SectionType::panorama: return "panorama";
    }
    return "unknown";
}

std::string_view to_string(Storage storage) { return storage == Storage::mapped ? "mapped" : "packed"; }

Bytes encode_header(const FileHeader &header) {
    ByteWriter out;
    out.append(kMagic);
    out.u16(header.major);
    out.u16(header.minor);
    out.u32(header.endian);
    out.u64(header.file_size);
    out.u64(header.table_offset);
    out.u32(header.table_count);
    out.u8(header.depth);
    out.zeros(3);
    out.u64(header.required_features);
    out.u64(header.optional_features);
    out.u64(header.point_count);
    out.u64(header.raw_bytes);
    out.u64(header.content_id[0]);
    out.u64(header.content_id[1]);
    out.u16(header.root.normal);
    out.append(header.root.colour);
    out.u8(header.root.material);
    out.u8(header.root.radius);
    out.u8(header.root.texture);
    out.append(header.root.shadow);
    out.u32(header.chunk_points);
    out.zeros(4);
    out.u64(header.table_hash);
    out.u64(hash64(out.bytes()));
    assert(out.size() == kHeaderBytes);
    return out.take();
}

namespace {

// What a file that is not .bvg seems to be, for the message.
std::string describe_magic(ByteView file) {
    const std::string_view text(reinterpret_cast<const char *>(file.data()), file.size());
    const auto starts = [&](std::string_view magic) { return text.starts_with(magic); };
    if (file.empty())
        return "the file is empty";
    if (starts("P1") || starts("P4"))
        return "this is a Netpbm bitmap, not a binary voxel grid (.bvg)";
    if (starts("ply"))
        return "this is a PLY file: turn it into a .bvg with pbm-build first";
    if (starts("solid") || starts("OFF"))
        return "this is a mesh: turn it into a .bvg with pbm-build first";
    if (starts("\x89"
               "BVG"))
        return "the file was damaged by a text-mode transfer";
    return "not a binary voxel grid (.bvg)";
}

} // namespace

Result<FileHeader> decode_header(ByteView file) {
    const std::size_t magic_bytes = std::min(file.size(), kMagic.size());
    if (file.empty() ||
        !std::equal(kMagic.begin(), kMagic.begin() + static_cast<std::ptrdiff_t>(magic_bytes), file.begin()))
        return Error{ErrorCode::not_bvg, 0, "2.1 " + describe_magic(file)};
    if (file.size() < kHeaderBytes)
        return Error{ErrorCode::truncated, file.size(), "2.2 the file ends inside its header"};
    ByteReader in(file.first(kHeaderBytes));
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
    header.root.normal = in.u16();
    for (auto &channel : header.root.colour)
        channel = in.u8();
    header.root.material = in.u8();
    header.root.radius = in.u8();
    header.root.texture = in.u8();
    for (auto &shadow : header.root.shadow)
        shadow = in.u8();
    header.chunk_points = in.u32();
    in.zeros(4);
    header.table_hash = in.u64();
    const std::uint64_t stored_hash = in.u64();

    // The hash comes before everything else: a flipped bit in the version is damage, not a new version.
    if (stored_hash != hash64(file.first(kHeaderBytes - 8)))
        return Error{ErrorCode::bad_hash, 0, "2.3 the header was changed: its hash does not match"};
    if (header.endian != kEndianTag)
        return Error{ErrorCode::bad_header, 12, "2.4 the endian tag is not 0x01020304"};
    // Before 1.0 every minor version may lay out its bytes anew (section 11).
    if (header.major != kMajorVersion || header.minor != kMinorVersion)
        return Error{ErrorCode::unsupported_version, 8,
                     "2.5 format version " + std::to_string(header.major) + "." + std::to_string(header.minor) +
                         ": this program reads " + std::to_string(kMajorVersion) + "." + std::to_string(kMinorVersion)};
    if ((header.required_features & ~kMappedFeature) != 0)
        return Error{ErrorCode::unsupported_feature, 40, "2.6 the file requires a feature this program does not know"};
    if (header.file_size > file.size())
        return Error{ErrorCode::truncated, file.size(),
                     "2.7 the file ends " + std::to_string(header.file_size - file.size()) + " bytes early"};
    if (header.file_size < file.size())
        return Error{ErrorCode::bad_header, header.file_size, "2.7 bytes after the end of the file"};
    if (!in.reserved_clear())
        return Error{ErrorCode::bad_header, clear_so_far ? 108U : 37U, "2.8 reserved bytes are not zero"};
    if (header.depth < kMinDepth || header.depth > kMaxDepth)
        return Error{ErrorCode::bad_header, 36, "2.9 depth is not 2..16"};
    if (header.point_count == 0 || header.point_count > kMaxPoints)
        return Error{ErrorCode::bad_header, 56, "2.10 point count is not 1..2^32-1"};
    if (header.chunk_points < kMinChunkPoints || header.chunk_points > kDefaultChunkPoints ||
        !std::has_single_bit(header.chunk_points))
        return Error{ErrorCode::bad_header, 104, "2.11 chunk limit is not a power of two from 512 to 65,536"};
    if (header.table_offset != kHeaderBytes)
        return Error{ErrorCode::bad_header, 24, "2.12 the section table does not follow the header"};
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

Bytes encode_section_table(std::span<const SectionEntry> entries) {
    ByteWriter out;
    for (const SectionEntry &entry : entries) {
        out.u32(static_cast<std::uint32_t>(entry.type));
        out.u16(static_cast<std::uint16_t>(entry.codec));
        out.u16(entry.flags);
        out.u32(entry.instance);
        out.u32(entry.element_bytes);
        out.u32(entry.alignment);
        out.zeros(4);
        out.u64(entry.offset);
        out.u64(entry.stored_bytes);
        out.u64(entry.raw_bytes);
        out.u64(entry.count);
        out.u64(entry.hash);
    }
    return out.take();
}

namespace {

bool known(SectionType type) {
    switch (type) {
    case SectionType::metadata:
    case SectionType::grid:
    case SectionType::attributes:
    case SectionType::materials:
    case SectionType::lights:
    case SectionType::texture:
    case SectionType::ground_plane:
    case SectionType::level_directory:
    case SectionType::level_chunks:
    case SectionType::level_bricks:
    case SectionType::ground_texture:
    case SectionType::ground_lit:
    case SectionType::panorama: return true;
    }
    return false;
}

// 3.2.15, 3.2.16
Status check_storage(const SectionEntry &entry, Storage storage, std::uint64_t at) {
    const bool bricks = entry.type == SectionType::level_bricks;
    if (storage == Storage::packed)
        return bricks ? Error{ErrorCode::bad_table, at, "3.2.15 bricks in a file that is not mapped"} : Status{};
    if (((bricks || is_raster(entry.type)) && entry.alignment != kMappedStreamAlignment) ||
        (entry.type == SectionType::level_chunks && entry.alignment != kMappedChunksAlignment))
        return Error{ErrorCode::bad_table, at + 16,
                     "3.2.16 " + std::string(to_string(entry.type)) + ": not the alignment of a mapped file"};
    return {};
}

// Rules of one entry that need nothing but itself and the header.
Status check_entry(const SectionEntry &entry, const FileHeader &header, std::uint64_t at) {
    const std::string name(to_string(entry.type));
    const bool chunks = entry.type == SectionType::level_chunks;
    const bool of_level =
        chunks || entry.type == SectionType::level_directory || entry.type == SectionType::level_bricks;
    const bool coded = chunks || is_raster(entry.type);
    const bool has_instance = entry.type == SectionType::ground_lit ? entry.instance < kMaxLights : entry.instance == 0;
    const Codec codec = coded && header.storage() == Storage::packed ? Codec::zstd_chunks : Codec::raw;
    if (!known(entry.type)) {
        if ((entry.flags & kCriticalFlag) != 0)
            return Error{ErrorCode::unsupported_feature, at,
                         "3.2.4 a critical section of a type this program does not know"};
    } else if (entry.codec != codec) {
        return Error{ErrorCode::unsupported_feature, at + 4,
                     "3.2.5 " + name + ": codec unknown to this program, or not that of a " +
                         std::string(to_string(header.storage())) + " file"};
    }
    if ((entry.flags & ~kCriticalFlag) != 0)
        return Error{ErrorCode::bad_table, at + 6, "3.2.6 " + name + ": unknown flag"};
    if (of_level ? entry.instance < 1 || entry.instance > header.depth : known(entry.type) && !has_instance)
        return Error{ErrorCode::bad_table, at + 8, "3.2.7 " + name + ": no such instance"};
    if (!std::has_single_bit(entry.alignment) || entry.alignment < kSectionAlignment || entry.alignment > 65536)
        return Error{ErrorCode::bad_table, at + 16,
                     "3.2.8 " + name + ": alignment is not a power of two from 8 to 65,536"};
    if (entry.codec == Codec::raw && entry.raw_bytes != entry.stored_bytes)
        return Error{ErrorCode::bad_table, at + 40, "3.2.9 " + name + ": raw section whose sizes differ"};
    if (entry.raw_bytes / kMaxExpansion > entry.stored_bytes)
        return Error{ErrorCode::too_large, at + 40, "3.2.10 " + name + ": expands more than 32,768 times"};
    const bool counted = entry.element_bytes > 0 && entry.raw_bytes % entry.element_bytes == 0 &&
                         entry.raw_bytes / entry.element_bytes == entry.count;
    if (known(entry.type) && (coded ? entry.element_bytes != 0 : !counted))
        return Error{ErrorCode::bad_table, at + 12,
                     "3.2.13 " + name + ": element size and count do not give the raw size"};
    return check_storage(entry, header.storage(), at);
}

} // namespace

Result<std::vector<SectionEntry>> decode_section_table(ByteView file, const FileHeader &header) {
    if (header.table_count == 0 || header.table_count > kMaxSections)
        return Error{ErrorCode::bad_header, 32, "3.1.1 section count is not 1..256"};
    const std::uint64_t table_bytes = header.table_count * kSectionEntryBytes;
    if (table_bytes > file.size() - kHeaderBytes)
        return Error{ErrorCode::truncated, file.size(), "3.1.2 the section table is cut short"};
    const ByteView table = file.subspan(kHeaderBytes, table_bytes);
    if (hash64(table) != header.table_hash)
        return Error{ErrorCode::bad_hash, kHeaderBytes, "3.1.3 the section table was changed: its hash does not match"};

    ByteReader in(table);
    std::vector<SectionEntry> entries;
    entries.reserve(header.table_count);
    std::uint64_t end = kHeaderBytes + table_bytes; // of the section before
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
            return Error{ErrorCode::bad_table, at + 20, "3.2.1 reserved bytes are not zero"};
        if (!entries.empty() && !(entries.back().order() < entry.order()))
            return Error{ErrorCode::bad_table, at, "3.2.2 sections are not in order, or one is there twice"};
        if (const Status status = check_entry(entry, header, at); !status)
            return status.error();
        const std::uint64_t expected = (end + entry.alignment - 1) / entry.alignment * entry.alignment;
        if (entry.offset != expected)
            return Error{ErrorCode::bad_table, at + 24,
                         "3.2.3 a section does not follow the one before at its alignment"};
        if (entry.offset > file.size() || entry.stored_bytes > file.size() - entry.offset)
            return Error{ErrorCode::truncated, file.size(), "3.2.11 a section lies outside the file"};
        end = entry.offset + entry.stored_bytes;
        if (entry.raw_bytes > ~raw_bytes)
            return Error{ErrorCode::bad_table, at + 40, "3.1.4 sizes overflow"};
        raw_bytes += entry.raw_bytes;
        entries.push_back(entry);
    }
    if (end != file.size())
        return Error{ErrorCode::bad_table, end, "3.1.5 bytes after the last section"};
    if (raw_bytes != header.raw_bytes)
        return Error{ErrorCode::bad_header, 64, "3.1.6 the header's raw size is not the sum of the sections'"};

    const auto missing = [&](SectionType type, std::uint32_t instance) {
        return std::none_of(entries.begin(), entries.end(), [&](const SectionEntry &entry) {
            return entry.type == type && entry.instance == instance;
        });
    };
    for (const SectionType type :
         {SectionType::metadata, SectionType::grid, SectionType::attributes, SectionType::materials})
        if (missing(type, 0))
            return Error{ErrorCode::bad_table, kHeaderBytes, "3.1.7 no " + std::string(to_string(type)) + " section"};
    for (std::uint32_t level = 1; level <= header.depth; ++level)
        for (const SectionType type :
             {SectionType::level_directory, SectionType::level_bricks, SectionType::level_chunks})
            if (missing(type, level) && (type != SectionType::level_bricks || header.storage() == Storage::mapped))
                return Error{ErrorCode::bad_table, kHeaderBytes,
                             "3.1.8 no " + std::string(to_string(type)) + " for level " + std::to_string(level)};
    return entries;
}

} // namespace pbm
