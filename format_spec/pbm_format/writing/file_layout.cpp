#include "pbm_format/writing/file_layout.h"

#include "pbm_format/container/section_encoder.h"
#include "pbm_format/hashes/hash.h"
#include "system/free_memory.h"

#include <algorithm>

namespace pbm {
namespace {

// Of a section of shapes.
bool has_tint(ByteView shapes) {
    for (std::size_t at = 1; at < shapes.size(); at += kShapeBytes)
        if (shapes[at] != 0)
            return true;
    return false;
}

} // namespace

Status check_small_sections(const ModelParameters &parameters, std::string_view metadata) {
    const int depth = parameters.grid.depth;
    Status status = check_metadata(as_bytes(metadata));
    const auto also = [&](const auto &decoded) {
        if (status && !decoded)
            status = decoded.error();
    };
    also(decode_grid(encode_grid(parameters.grid), depth));
    also(decode_attributes(encode_attributes(parameters.attributes, depth), depth));
    also(decode_materials(encode_materials(parameters.materials)));
    if (!parameters.lights.empty())
        also(decode_lights(encode_lights(parameters.lights)));
    if (!parameters.texture.empty())
        also(decode_texture(encode_texture(parameters.texture.front())));
    if (parameters.ground)
        also(decode_ground_plane(encode_ground_plane(*parameters.ground)));
    also(check_parameters(parameters));
    return status;
}

EncodedSection record_section(SectionType type, std::uint32_t instance, std::uint32_t record_bytes, Bytes stored,
                              std::uint32_t alignment) {
    const std::uint64_t bytes = stored.size();
    return {{.type = type,
             .instance = instance,
             .element_bytes = record_bytes,
             .alignment = alignment,
             .raw_bytes = bytes,
             .count = bytes / record_bytes},
            std::move(stored)};
}

std::vector<EncodedSection> encode_small_sections(const ModelParameters &parameters, std::string_view metadata) {
    std::vector<EncodedSection> sections;
    const auto add = [&](SectionType type, std::size_t record_bytes, Bytes stored) {
        sections.push_back(record_section(type, 0, static_cast<std::uint32_t>(record_bytes), std::move(stored)));
    };
    add(SectionType::metadata, 1, Bytes(metadata.begin(), metadata.end()));
    add(SectionType::grid, 48, encode_grid(parameters.grid));
    add(SectionType::attributes, 24, encode_attributes(parameters.attributes, parameters.grid.depth));
    add(SectionType::materials, 32, encode_materials(parameters.materials));
    if (!parameters.lights.empty())
        add(SectionType::lights, 48, encode_lights(parameters.lights));
    if (!parameters.texture.empty())
        add(SectionType::texture, 800, encode_texture(parameters.texture.front()));
    if (parameters.ground) {
        Bytes ground = encode_ground_plane(*parameters.ground);
        const std::size_t bytes = ground.size();
        add(SectionType::ground_plane, bytes, std::move(ground));
    }
    return sections;
}

void FileLayout::add(SectionEntry entry, Bytes stored) {
    entry.flags = traits_of(entry.type)->is_optional ? 0 : kCriticalFlag;
    entry.stored_bytes = stored.size();
    entry.hash = hash64(stored);
    entries_.push_back(entry);
    stored_.push_back(std::move(stored));
}

Bytes FileLayout::assemble(FileHeader header) {
    std::uint64_t end = kHeaderBytes + entries_.size() * kSectionEntryBytes;
    header.minor = header.closed() ? 2 : 0;
    header.optional_features &= kClosedFeature;
    header.raw_bytes = 0;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        SectionEntry &entry = entries_[i];
        if (entry.type == SectionType::fields) {
            header.minor = std::max<std::uint16_t>(header.minor, 1);
            header.optional_features |= kFieldsFeature;
        }
        if (entry.type == SectionType::shapes)
            header.minor = std::max<std::uint16_t>(header.minor, has_tint(stored_[i]) ? 5 : 3);
        if (traits_of(entry.type)->is_point_stream)
            header.minor = std::max<std::uint16_t>(
                header.minor, entry.instance / kStreamKinds == static_cast<std::uint32_t>(PointStream::sides) ? 4 : 6);
        entry.offset = (end + entry.alignment - 1) / entry.alignment * entry.alignment;
        end = entry.offset + entry.stored_bytes;
        header.raw_bytes += entry.raw_bytes;
    }
    const Bytes table = encode_section_table(entries_);
    header.file_size = end;
    header.table_count = static_cast<std::uint32_t>(entries_.size());
    header.table_hash = hash64(table);
    Bytes file;
    file.reserve(end);
    const Bytes head = encode_header(header);
    file.insert(file.end(), head.begin(), head.end());
    file.insert(file.end(), table.begin(), table.end());
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        file.resize(entries_[i].offset, 0);
        file.insert(file.end(), stored_[i].begin(), stored_[i].end());
        free_memory(stored_[i]);
    }
    return file;
}

} // namespace pbm
